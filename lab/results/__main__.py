"""Results whose code has changed, and the tables that show results.

Run from the root of the repository::

    python -m lab.results                  # which results are of other code, and what renews them
    python -m lab.results --write          # write the tables into README and docs
    python -m lab.results --check          # `make check`: do README and docs show the records?
                                             # and is each record's origin what its file says?
    python -m lab.results --stamp NAME     # after a measurement: fingerprints at its commit
"""

import argparse
import json
import re
import subprocess
import sys
from functools import cache

from lab.results.doubts import CELLS, cells_of, doubts, older_cells
from lab.results.record import FOLDER, ROOT, Record, combined, fingerprints_at, records
from lab.results.tables import TABLES, shown
from tendon_newton.data.files.json_file import write_json


def with_table(text: str, name: str, table: str) -> str:
    """Return a page's text with a table between its marks."""
    begin, end = f"<!-- results: {name} -->\n", f"<!-- end of {name} -->"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if len(pattern.findall(text)) != 1:
        raise ValueError(f"expected one pair of marks {begin.strip()} ... {end}")
    return pattern.sub(lambda _: f"{begin}\n{table}\n\n{end}", text)


def write(*, only_compare: bool) -> int:
    """Write every table into its page, or tell which pages differ; return how many did."""
    kept, differ = records(), 0
    for name, (page, _) in TABLES.items():
        path = ROOT / page
        before = path.read_text(encoding="utf-8")
        after = with_table(before, name, shown(name, kept))
        if before == after:
            continue
        differ += 1
        if only_compare:
            sys.stdout.write(f"{page}: table {name} is not that of its records; "
                             "run python -m lab.results --write\n")  # fmt: skip
        else:
            path.write_text(after, encoding="utf-8")
    return differ if only_compare else 0


def tell() -> None:
    """List each result: fresh, or what has changed since and how it is measured again."""
    for name, record in records().items():
        sys.stdout.write(f"{name}: {record.commit[:12]}, {record.date}, {record.device}\n")
        if changed := record.changed:
            sys.stdout.write(f"  CHANGED since: {', '.join(changed)}\n")
            sys.stdout.write(f"  {record.minutes:g} min: {record.command}\n")


def stamp(name: str) -> None:
    """Write into a record the origin that its file states, and its code's fingerprints there.

    Cells that state none get that of their commit.
    """
    path = FOLDER / f"{name}.json"
    fields = json.loads(path.read_text(encoding="utf-8"))
    figures = Record(name=name, **fields).figures
    stated = figures.get("commit") if fields.get("data") and isinstance(figures, dict) else None
    fields["clean"] = None
    if stated is not None:
        fields["commit"], _, changed = stated.partition("-")
        fields["clean"] = not changed
    rows = CELLS.get(name)
    if rows is not None:
        for _, row, cell in cells_of(figures):
            if "code" not in cell:
                cell["code"] = combined(code_at(cell["commit"], rows(row)))
            fields["code"] |= dict.fromkeys(rows(row), "")
        write_json(ROOT / fields["data"], figures)
    fields["code"] = fingerprints_at(fields["commit"], fields["code"])
    if rows is not None:
        told = Record(name=name, **fields)
        fields["older"] = dict(older_cells(told, rows))
    path.write_text(json.dumps(fields, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


@cache
def code_at(commit: str, names: tuple[str, ...]) -> dict[str, str]:
    """Return the fingerprints that files and folders had at a commit, empty where none was."""
    words = ["git", "ls-tree", "--name-only", commit, *names]
    told = subprocess.run(words, cwd=ROOT, capture_output=True, check=True, text=True).stdout
    there = [name for name in names if name in told.splitlines()]
    return dict.fromkeys(names, "") | fingerprints_at(commit, there)


def doubted() -> int:
    """Say what is wrong with the origin of records; return how much that is."""
    told = [f"{name}: {doubt}" for name, record in records().items() for doubt in doubts(record)]
    for line in told:
        sys.stdout.write(
            f"lab/results/records/{line}; run python -m lab.results --stamp, or measure it again\n"
        )
    return len(told)


def main() -> int:
    """Do what was asked for; return how many tables differ."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--write", action="store_true", help="write the tables into their pages")
    parser.add_argument("--check", action="store_true", help="fail where a page differs")
    parser.add_argument("--stamp", metavar="NAME", help="fingerprint the code of a record")
    arguments = parser.parse_args()
    if arguments.stamp:
        try:
            stamp(arguments.stamp)
        except subprocess.CalledProcessError as failed:
            sys.stderr.write(failed.stderr.decode())
            return 1
        return 0
    if arguments.write or arguments.check:
        return write(only_compare=arguments.check) + (doubted() if arguments.check else 0)
    tell()
    return 0


if __name__ == "__main__":
    sys.exit(main())
