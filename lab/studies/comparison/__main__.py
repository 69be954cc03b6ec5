"""The page that compares everybody on the same logs and splits.

``python -m lab.studies.comparison --xl330 LOGS --sts3215 LOGS --so101 LOGS --bam PYTHON`` fits
and tests what is missing in ``comparison.json`` and prints the page's tables; ``python -m
lab.results --write`` puts them there. ``--anew`` makes every row again that was not made at this
commit, in a tree without changes, so that a run that broke off goes on. ``--jobs N`` works on so
many splits at once.
"""

import argparse
from functools import partial
from pathlib import Path

from lab.studies.comparison.rows import RESULTS, alike, make_rows, results_in, wanted
from lab.studies.comparison.splits import splits_of
from lab.studies.comparison.table import ratios, tables
from tendon_newton.data.files.origin import git_commit
from tendon_newton.scheduler import JobOptions, completed


def main() -> None:
    """Make what is missing and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--xl330", type=Path)
    parser.add_argument("--sts3215", type=Path)
    parser.add_argument("--so101", type=Path)
    parser.add_argument("--bam", type=Path, help="Python of an environment that has their program")
    parser.add_argument("--seconds", type=float, default=3600.0, help="of each of their fits")
    parser.add_argument("--diagnose", action="store_true", help="let a diagnosis choose as well")
    parser.add_argument("--results", type=Path, default=RESULTS, help="where they are kept")
    parser.add_argument("--row", action="append", help="rows that are made: all by default")
    parser.add_argument("--split", action="append", help="splits that are made: all by default")
    parser.add_argument("--anew", action="store_true", help="make rows of other commits again")
    parser.add_argument("--jobs", type=int, default=1, help="splits that are worked on at once")
    chosen = parser.parse_args()
    if chosen.anew and (git_commit() or "-").count("-"):
        parser.error("--anew wants a clone without changes: commit them, or rows say nothing")
    every = splits_of(chosen.xl330, chosen.sts3215, chosen.so101)
    chosen.alike = {each.key: alike(each, every) for each in every}
    splits = [split for split in every if wanted(split.key, chosen.split)]
    for _ in completed(partial(make_rows, chosen=chosen), splits, JobOptions(jobs=chosen.jobs)):
        pass
    found = results_in(chosen.results)
    print(tables(found), ratios(found), sep="\n\n")


if __name__ == "__main__":
    main()
