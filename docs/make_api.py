"""The page on the public names: ``python docs/make_api.py`` writes it from the package's table."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import tendon_newton

PAGE = Path(__file__).resolve().parent / "api.md"
INTRODUCTION = (
    "# Public names\n\n"
    "`import tendon_newton as tn` has the names below; [a tour](python.md) uses most of them. "
    "`help(tn.NAME)` has arguments, shapes, units and errors, and so has the site of `make docs`, "
    "below this table. The package's own table makes this page (`python docs/make_api.py`), and a "
    "test compares the two.\n\n"
)


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(), encoding="utf-8")


def page() -> str:
    """Return the page in Markdown."""
    lines = ["| name | what it is | module |", "|---|---|---|"]
    for name, module in tendon_newton.EXPORTS.items():
        lines.append(f"| `{name}` | {summary(getattr(tendon_newton, name))} | `{module}` |")
    return INTRODUCTION + "\n".join(lines) + "\n"


def summary(value: Any) -> str:
    """Return what a name is, on a line."""
    if isinstance(value, dict):
        return f"table of {len(value)}: {', '.join(list(value)[:3])}, ..."
    return (inspect.getdoc(value) or "").split("\n")[0]


if __name__ == "__main__":
    main()
