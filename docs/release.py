"""Write a new version into all files that state one: ``python docs/release.py 0.2.0``."""

import re
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CHANGES = "CHANGELOG.md"
# What a version looks like in each file: `\1` stands before it
STATED = {
    "pyproject.toml": r'(^version = )"[\d.]+"',
    "lab/pyproject.toml": r'(^version = )"[\d.]+"',
    "conda/recipe.yaml": r'(^  version: )"[\d.]+"',
    "CITATION.cff": r"(^version: )[\d.]+",
}
UNRELEASED = "## [Unreleased]\n"


def released(texts: Mapping[str, str], version: str, day: str) -> dict[str, str]:
    """Return the files with a version and its day (2026-11-30), and a list of changes begun anew.

    Raises:
        SystemExit: That is no later version, or nothing has changed since the last one.
    """
    if not re.fullmatch(r"\d+\.\d+\.\d+", version) or parts(version) <= parts(stated(texts)):
        raise SystemExit(
            f"a version is three numbers and later than {stated(texts)}, not {version}"
        )
    before, _, after = texts[CHANGES].partition(UNRELEASED)
    if not after.strip() or after.lstrip().startswith("## "):
        raise SystemExit(f"{CHANGES}: nothing stands under Unreleased")
    new = {CHANGES: f"{before}{UNRELEASED}\n## [{version}] - {day}\n{after}"}
    for name, pattern in STATED.items():
        number = version if name.endswith(".cff") else f'"{version}"'
        new[name] = re.sub(pattern, rf"\g<1>{number}", texts[name], flags=re.MULTILINE)
    citation = re.sub(r"^date-released: .*\n", "", new["CITATION.cff"], flags=re.MULTILINE)
    new["CITATION.cff"] = f"{citation}date-released: {day}\n"
    return new


def stated(texts: Mapping[str, str]) -> str:
    """Return the version that pyproject.toml states."""
    (found,) = re.findall(r'^version = "(.*)"', texts["pyproject.toml"], flags=re.MULTILINE)
    return found


def parts(version: str) -> tuple[int, ...]:
    """Return a version as numbers, which have an order."""
    return tuple(int(part) for part in version.split("."))


def read() -> dict[str, str]:
    """Return the files that a release changes."""
    return {name: (ROOT / name).read_text(encoding="utf-8") for name in (*STATED, CHANGES)}


def main() -> None:
    """Write the files, and say what is next."""
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    version = sys.argv[1]
    day = datetime.now(UTC).date().isoformat()
    for name, text in released(read(), version, day).items():
        (ROOT / name).write_text(text, encoding="utf-8")
    names = ", ".join((*STATED, CHANGES))
    sys.stdout.write(f"{names} say {version}; commit them, then: git tag v{version}\n")


if __name__ == "__main__":
    main()
