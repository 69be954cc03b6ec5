"""The tables of the servos that ship."""

import json
from collections.abc import Mapping
from typing import Any

from lab.results.cells import table as table_of
from lab.results.record import ROOT

SERVOS = ROOT / "assets" / "servos"
EVIDENCE = "evidence.json"


def names() -> list[str]:
    """Return the names of the servos that ship."""
    return sorted((home.parent.name for home in SERVOS.glob(f"*/{EVIDENCE}")), reverse=True)


def read_evidence() -> dict[str, dict[str, Any]]:
    """Return the evidence of every servo that ships."""
    return {name: json.loads((SERVOS / name / EVIDENCE).read_text()) for name in names()}


def table(rivals: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """Return errors of the servos that ship beside others' on the same logs.

    Args:
        rivals: Rows of the comparison, by split.
    """
    rows = []
    for name, told in read_evidence().items():
        own = rivals[told["split"]]
        bam = {row: own[row]["held_out"] for row in own if row.startswith("bam ")}
        best = min(bam, key=lambda row: bam[row])
        low, high = told["gains"]
        volts = "{:.1f} to {:.1f}".format(*told["supply_v"])
        rows.append(
            (
                f"`{name}`",
                f"{told['source']} ({told['licence']})",
                f"{told['fitted']} ({told['logs'][0]} logs)",
                f"{told['held_out']} ({told['logs'][1]})",
                f"{told['held_out_mrad']:.1f}",
                f"{bam[best]:.1f} ({best.removeprefix('bam ')}) to {max(bam.values()):.1f}",
                f"{own['data sheet']['held_out']:.1f}",
                f"{low:g} to {high:g}; {volts} V; {told['load_nm']:.2f} N m",
            )
        )
    heads = ("servo", "logs", "fitted", "held out", "error [mrad]", "bam m1 to m6, same logs",
             "data sheet", "gains; supply; load")  # fmt: skip
    return table_of(heads, rows)
