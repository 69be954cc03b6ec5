"""A reproduction as a JSON file with every number and as a page to read."""

from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

from tendon_lab.reproduction.outcome import Outcome, Row
from tendon_lab.reproduction.reproduction import Reproduction
from tendon_lab.reproduction.steps.stage_list import REPRODUCTION_STAGES
from tendon_newton import __version__
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import git_commit
from tendon_newton.data.files.text_file import write_text

SCHEMA = 1
VIRTUAL = (
    "**The bench is virtual.** Every number in the column *ours* comes from the "
    "emulated servo, load cell and finger of `docs/virtual_bench.md`, not from a measurement; the "
    "paper's come from its real bench. What else differs is said in the row."
)
REAL = "The recordings were given; the paper's numbers come from its own bench."


def write_report(reproduction: Reproduction, outcomes: Mapping[str, Outcome]) -> tuple[Path, Path]:
    """Write ``reproduction.json`` and ``reproduction.md`` and return where they are.

    Raises:
        InvalidOutput: A file cannot be written.
    """
    table = {
        "schema": SCHEMA,
        "settings": asdict(reproduction.settings),
        "version": __version__,
        "git_commit": git_commit(),
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
        "virtual": reproduction.is_virtual,
        "data_sha256": {unit.name: unit.sha256 for unit in reproduction.units},
        "stages": {name: asdict(outcome) for name, outcome in outcomes.items()},
    }
    files = (reproduction.out / "reproduction.json", reproduction.out / "reproduction.md")
    write_json(files[0], table)
    write_text(files[1], to_markdown(reproduction, outcomes))
    return files


def to_markdown(reproduction: Reproduction, outcomes: Mapping[str, Outcome]) -> str:
    """Return the page: the table of all rows, then every stage with its words."""
    settings = reproduction.settings
    parts = [
        f"# The paper's results, reproduced ({settings.name})",
        VIRTUAL if reproduction.is_virtual else REAL,
        f"{len(reproduction.units)} benches, seed {settings.seed}. *Ours* is the median, with "
        "least and greatest in brackets, over what the last but one column says.",
        rows_table([row for outcome in outcomes.values() for row in outcome.rows]),
    ]
    for name, outcome in outcomes.items():
        parts.append(f"## {REPRODUCTION_STAGES[name].title}")
        if outcome.text:
            parts.append(outcome.text)
    missing = [name for name in REPRODUCTION_STAGES if name not in outcomes]
    if missing:
        parts.append(f"Not run: {', '.join(missing)}.")
    return "\n\n".join(part for part in parts if part) + "\n"


def rows_table(rows: list[Row]) -> str:
    """Return the paper's values beside ours."""
    lines = [
        "| experiment | measured | paper | ours | over | what differs |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        paper = "" if row.paper is None else f"{number(row.paper)} {row.unit}"
        spread = f" ({number(row.low)} to {number(row.high)})" if row.count > 1 else ""
        lines.append(
            f"| {row.experiment} | {row.measure} | {paper} | {number(row.ours)} {row.unit}{spread} "
            f"| {row.count} {row.over} | {row.differs} |"
        )
    return "\n".join(lines)


def number(value: float) -> str:
    """Write a number with three digits."""
    return f"{value:.3g}" if abs(value) < 100.0 else f"{value:.0f}"
