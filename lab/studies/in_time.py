"""What is told of change on virtual units: between days, within recordings, and after a mend.

``python -m lab.studies.in_time PART 100 101 102 --out DIR [--runs 10] [--jobs N]``

PART is ``days``, then ``events``, whose models are the answers of the days, or ``mends``. What is
in DIR already is not done again. ``in_time.json`` has the rates of all parts, and ``PART.json``
every unit.
"""

import argparse
from functools import partial
from pathlib import Path

from lab.studies import days, events, mending
from lab.studies.units import read
from tendon_newton.data.files.json_file import write_json
from tendon_newton.scheduler import JobOptions, completed

SUMMARIES = {"days": days.summary, "events": events.summary, "mends": mending.summary}


def main() -> None:
    """Print the rates of a part, and write them beside those of the others."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=SUMMARIES)
    parser.add_argument("units", type=int, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--runs", type=int, default=10, help="with an event, of each unit")
    parser.add_argument("--jobs", type=int, default=1)
    a = parser.parse_args()
    out = a.out / a.part
    out.mkdir(parents=True, exist_ok=True)
    work = {
        "days": partial(days.pairs_of, out=out),
        "events": partial(events.events_of, days=a.out / "days", out=out, runs=a.runs),
        "mends": partial(mending.mends_of, out=out),
    }[a.part]
    rows = [row for _, row in completed(work, a.units, JobOptions(jobs=a.jobs))]
    rows.sort(key=lambda row: row["unit"])
    write_json(a.out / f"{a.part}.json", rows)
    file = a.out / "in_time.json"
    rates = SUMMARIES[a.part]([run for row in rows for run in row.get("runs", [row])])
    units = [row["unit"] for row in rows]
    others = read(file) if file.exists() else {}
    write_json(file, {**others, a.part: {"units": units, "rates": rates}})
    for name, found in rates.items():
        print(f"{name:24s} {found['hits']} of {found['of']}")


if __name__ == "__main__":
    main()
