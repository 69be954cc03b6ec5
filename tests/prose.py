"""The sentences of a Markdown text, one by one."""

import re
from collections.abc import Iterator

FENCE = re.compile(r"^( *)```.*?^\1```$", re.DOTALL | re.MULTILINE)
BREAK = re.compile(r"^\s*(?:$|#+ |\|.*|[-*] |\d+\. |!\[.*)")
"""A line that ends the paragraph before it."""
END = re.compile(r"(?<=[.!?:])[*_)\"]*\s+(?=[*_(\"]*[A-Z`\d])|(?<=:)\s+(?=`)")


def plain(text: str) -> str:
    """Return a text whose code and formulas count as one word, and whose links are their words."""
    text = re.sub(r"``.+?``|`[^`]+`", "`x`", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    return re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)


def paragraphs(text: str) -> Iterator[str]:
    """Return the paragraphs, list items, headings and table cells of a text without its code."""
    held: list[str] = []
    for line in [*FENCE.sub("", text).splitlines(), ""]:
        if BREAK.match(line):
            yield " ".join(held)
            held = []
        if line.startswith("|"):
            yield from plain(line).strip("|").split("|")
        elif not line.startswith("#"):
            held.append(re.sub(r"^\s*(?:[-*]|\d+\.) ", "", line.strip()))


def sentences(text: str) -> Iterator[str]:
    """Return the sentences of a Markdown text."""
    for paragraph in paragraphs(text):
        for sentence in END.split(plain(paragraph)):
            if sentence.strip():
                yield sentence.strip()


def word_count(sentence: str) -> int:
    """Return the words and numbers of a sentence."""
    return sum(bool(re.search(r"\w", word)) for word in sentence.split())
