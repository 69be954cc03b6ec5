"""Spoil files of every format and read each.

  python -m tests.fuzz --files 10000 --seed 1

No file may end in a traceback, take more than 5 s of a core or 1 GB, or make anybody open a file
outside its folder. A failure is named by seed, target and number, by which it
is the same in every run.
"""

import argparse
import sys
from pathlib import Path

from tests.fuzz.command import fuzz, write_failures
from tests.fuzz.targets import PRODUCT


def main() -> int:
    """Run the command line; return 1 where a file failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--files", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", nargs="*", default=[], help="targets")
    parser.add_argument("--out", type=Path, help="file for the failures")
    parser.add_argument("--groups", default=PRODUCT, metavar="MODULE", help="what has the targets")
    words = parser.parse_args()
    tally = fuzz(words.files, seed=words.seed, jobs=words.jobs, only=words.only,
                 module=words.groups, report=print)  # fmt: skip
    print(tally.text())
    if words.out:
        write_failures(words.out, tally)
    return 1 if tally.failures else 0


if __name__ == "__main__":
    sys.exit(main())
