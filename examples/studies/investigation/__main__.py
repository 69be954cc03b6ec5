"""Is an investigation worth more than a fixed plan, and does it keep the limits of a bench?

``python -m examples.studies.investigation unit 50 --way investigate --out DIR``

The unit has three wrong things that its seed plants. They are looked for by ``investigate``, or by
the plan ``quick`` of ``collect`` and one diagnosis, in the same time at the bench, or in half of
it. One process does one unit in one way. All are judged by recordings that neither has seen.

``python -m examples.studies.investigation limits DIR/investigate_50 --out FILE``

Runs are designed anew for each moment of investigations, one search for each seed.

``python -m examples.studies.investigation table DIR``

It prints what all results of a folder come to, and draws the limits. Every call goes on where it
was stopped, and each result is written as soon as it is there.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from examples.studies.investigation.limits import draw_limits, limits, limits_table, read_peaks
from examples.studies.investigation.one_unit import INVESTIGATE, WAYS, look, read_result
from examples.studies.investigation.table import comparison, information, unit_table
from tendon_newton.cli.duration import read_duration
from tendon_newton.device_code.quiet import quiet_warp


def table(folder: Path) -> None:
    """Print all that the results of a folder come to."""
    results = [read_result(path) for path in sorted(folder.glob("result_*.json"))]
    if results:
        print("\n\n".join((unit_table(results), comparison(results), information(results))))
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
    part = parts.add_parser("limits")
    part.add_argument("folders", type=Path, nargs="+", help="investigations")
    part.add_argument("--out", type=Path, default=Path("limits.json"))
    part.add_argument("--seeds", type=int, nargs=2, default=(0, 100), metavar=("FIRST", "END"))
    part.add_argument("--wall", default="10h", help="after which no search is begun")
    part = parts.add_parser("table")
    part.add_argument("folder", type=Path)
    words = parser.parse_args()
    if words.part == "table":
        table(words.folder)
        return
    quiet_warp()
    if words.part == "unit":
        look(words.unit, words.way, words.out, words.run_length)
        return
    wall = read_duration(words.wall, "--wall")
    limits(words.folders, range(*words.seeds), words.out, wall=wall)


if __name__ == "__main__":
    main()
