"""List the studies: each is one measurement that the documentation cites."""

from pathlib import Path


def main() -> None:
    """Print each study's command and what the study measures."""
    for path in sorted(Path(__file__).parent.glob("[a-z]*.py")):
        summary = path.read_text(encoding="utf-8").split('"""')[1].splitlines()[0]
        print(f"python -m lab.studies.{path.stem:22s} {summary}")


if __name__ == "__main__":
    main()
