"""Print what mistakes get: what was done, by which door it came in, and what is said."""

import argparse
import sys
import tempfile
from pathlib import Path

from tests.doors.reports import rows_of_reports
from tests.doors.told import EVERY, line_said


def main() -> int:
    """Print a row for each mistake and door; those of public reports first. 1 if one is silent."""
    parser = argparse.ArgumentParser(prog="python -m tests.doors", description=__doc__)
    parser.add_argument("--reports", action="store_true", help="the table of public reports")
    if parser.parse_args().reports:
        rows = rows_of_reports()
        print("\n".join(rows))
        return any(row.startswith("WRONG") for row in rows)
    silent = 0
    for mistake in sorted(EVERY, key=lambda mistake: (not mistake.thread, mistake.thread)):
        for name, door in mistake.doors.items():
            with tempfile.TemporaryDirectory() as folder:
                line = line_said(Path(folder), door, mistake)
            silent += line is None
            print(f"{mistake.thread or '-':32} {mistake.name:48} {name:20} {line or 'SILENT'}")
    print(f"{len(EVERY)} mistakes, {silent} of their rows silent")
    return silent > 0


sys.exit(main())
