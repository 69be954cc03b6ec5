"""The page about gradients keeps its promise."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[3] / "docs" / "gradients.md"


@pytest.mark.slow
def test_the_block_of_the_page_finds_the_numbers_that_it_says(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The page's Python, run as it stands, prints the answer below it."""
    text = PAGE.read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (answer,) = re.findall(r"The answer is ([\d.]+) N/rad and ([\d.]+) N\.", text)
    exec(block, {})
    assert capsys.readouterr().out.splitlines()[-1] == "{} N/rad, {} N".format(*answer)
