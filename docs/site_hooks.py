"""What turns the repository's texts into a site: pages from outside docs/, and the API's names."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import tendon_newton

ROOT = Path(__file__).resolve().parents[1]
PAGES = {
    "README.md": "overview.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
"""Texts beside docs/, and their pages; a README in docs/ would take the index's place."""
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


def on_config(config: Any) -> Any:
    """Show the version in the title of the site."""
    config.site_name = f"tendon_newton {tendon_newton.__version__}"
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the texts that stand outside docs/."""
    from mkdocs.structure.files import File

    for name, page in PAGES.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=LINK.sub(from_root, text)))
    return files


def on_page_markdown(markdown: str, *, page: Any, **others: Any) -> str:
    """Lead links to the pages that texts have here; describe every name on the page of names."""
    text = LINK.sub(from_docs, markdown)
    if page.file.src_uri != "api.md":
        return text
    names = [f"::: {module}.{name}" for name, module in tendon_newton.EXPORTS.items()]
    return "\n\n".join([text, *names])


def from_root(link: re.Match[str]) -> str:
    """Return a link of a text in the root as the site has it."""
    return relinked(link, link[3].removeprefix("docs/") if link[3].startswith("docs/") else None)


def from_docs(link: re.Match[str]) -> str:
    """Return a link of a page as the site has it."""
    return relinked(link, None if link[3].startswith("../") else link[3])


def relinked(link: re.Match[str], inside: str | None) -> str:
    """Return a link to a page of the site; what is no page becomes its words.

    Args:
        link: The link as it is written.
        inside: Its target where that is a file of docs/.
    """
    picture, words, target = link.groups()
    if inside is not None:
        return f"{picture}[{words}]({inside})"
    file, mark, section = target.removeprefix("../").partition("#")
    if "://" in target or not file or file in PAGES.values():
        return link[0]
    if file in PAGES:
        return f"{picture}[{words}]({PAGES[file]}{mark}{section})"
    return words
