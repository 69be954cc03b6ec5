"""Is an investigation worth more than a fixed plan, and does it keep the limits of a bench?

``python -m examples.studies.investigation unit 40 --way investigate --out DIR``

The unit has three wrong things that its seed plants. They are looked for by ``investigate``, or by
a plan of ``collect`` (quick, paper) and one diagnosis. One process does one unit in one way.

``python -m examples.studies.investigation limits DIR/investigate_40/diagnosis_1 --out FILE``

Commands are optimised for diagnoses and benches in turn, one search for each seed.

``python -m examples.studies.investigation table DIR``

It prints what all results of a folder come to, and draws the limits. Every call goes on where it
was stopped, and each result is written as soon as it is there.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from examples.studies.investigation.limits import draw_limits, limits, limits_table, read_peaks
from examples.studies.investigation.one_unit import (
    INVESTIGATE,
    PAPER,
    QUICK,
    WAYS,
    Effort,
    look,
    read_result,
)
from examples.studies.investigation.table import comparison, information, unit_table
from tendon_newton.cli.duration import read_duration
from tendon_newton.device_code.quiet import quiet_warp


def table(folder: Path) -> None:
    """Print all that the results of a folder come to."""
    results = [read_result(path) for path in sorted(folder.glob("result_*.json"))]
    if results:
        print(unit_table(results))
        for way in (QUICK, PAPER):
            print(f"\n{comparison(results, way)}")
        print(f"\n{information([r for r in results if r.way == INVESTIGATE])}")
    searched, peaks = read_peaks(sorted(folder.glob("limits*.json")))
    if peaks:
        print(f"\n{limits_table(searched, peaks)}")
        draw_limits(peaks, folder / "limits.png")


def main() -> None:
    """Run the part that was asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parts = parser.add_subparsers(dest="part", required=True)
    part = parts.add_parser("unit")
    part.add_argument("unit", type=int)
    part.add_argument("--way", choices=WAYS, default=INVESTIGATE)
    part.add_argument("--out", type=Path, required=True)
    part.add_argument("--run-length", type=float, default=9.0, help="of an investigation [s]")
    part.add_argument("--budget", default="3min", help="time of its recordings")
    part.add_argument("--diagnosis-budget", help="time of each diagnosis")
    part.add_argument("--wall", default="10h", help="after which no run is begun")
    part = parts.add_parser("limits")
    part.add_argument("diagnoses", type=Path, nargs="+", help="folders diagnosis_1, ...")
    part.add_argument("--out", type=Path, default=Path("limits.json"))
    part.add_argument("--seeds", type=int, nargs=2, default=(0, 100), metavar=("FIRST", "END"))
    part.add_argument("--run-length", type=float, default=9.0, help="[s]")
    part.add_argument("--wall", default="10h", help="after which no search is begun")
    part = parts.add_parser("table")
    part.add_argument("folder", type=Path)
    words = parser.parse_args()
    if words.part == "table":
        table(words.folder)
        return
    quiet_warp()
    wall = read_duration(words.wall, "--wall")
    if words.part == "limits":
        seeds = range(*words.seeds)
        limits(words.diagnoses, seeds, words.out, length=words.run_length, wall=wall)
        return
    each = words.diagnosis_budget
    effort = Effort(
        bench=read_duration(words.budget, "--budget"),
        run_length=words.run_length,
        diagnosis=None if each is None else read_duration(each, "--diagnosis-budget"),
        wall=wall,
    )
    look(words.unit, words.way, words.out, effort)


if __name__ == "__main__":
    main()
