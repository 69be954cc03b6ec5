"""Score a program's findings: ``python score.py truth.json findings.json``. Needs Python alone.

Findings are a JSON object: the name of each log, and a list of what was found in it, each with a
``kind`` and, where the program says so, a ``joint``, an ``episode`` and ``rows`` (first, last). A
log that is not named is one in which nothing was found. What is said of a log and of its clean
twin alike is no answer to the fault.
"""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

Findings = Mapping[str, Sequence[Mapping[str, Any]]]
Truth = Mapping[str, Mapping[str, Any]]


def score(truth: Truth, findings: Findings) -> dict[str, Any]:
    """Return counts of right answers, each with the count of logs.

    Args:
        truth: By log: ``kind`` (None in a clean log), ``size`` (0, 1, 2), ``also`` (kinds that
            name it as well), ``joint`` (None for all), ``spoilt`` (first and last row by episode)
            and ``twin``.
        findings: What a program found, by log.
    """
    faulty = {log: own for log, own in truth.items() if own["kind"]}
    clean = [log for log, own in truth.items() if not own["kind"]]
    named = {log for log, own in faulty.items() if answers(own, findings, log, named=True)}
    seen = {log for log, own in faulty.items() if answers(own, findings, log, named=False)}
    placed = [
        any(lies(one, own) for one in stated)
        for log, own in faulty.items()
        if (stated := [x for x in answers(own, findings, log, named=True) if x.get("rows")])
    ]
    kinds = list(dict.fromkeys(own["kind"] for own in faulty.values()))

    def count(logs: set[str], key: str, value: Any) -> list[int]:
        own = [log for log, one in faulty.items() if one[key] == value]
        return [sum(log in logs for log in own), len(own)]

    silent = sum(not findings.get(log) for log in clean)
    balanced = 0.5 * (len(named) / len(faulty) + silent / len(clean))
    return {
        "named": [len(named), len(faulty)],
        "seen": [len(seen), len(faulty)],
        "rows_right": [sum(placed), len(placed)],
        "clean_and_silent": [silent, len(clean)],
        "balanced": round(balanced, 3),
        "named_by_size": [count(named, "size", size) for size in range(3)],
        "named_by_kind": {kind: count(named, "kind", kind) for kind in kinds},
        "seen_by_kind": {kind: count(seen, "kind", kind) for kind in kinds},
    }


def answers(
    own: Mapping[str, Any], findings: Findings, log: str, *, named: bool
) -> list[Mapping[str, Any]]:
    """Return the findings at the right joint that the twin does not have; named: by its kind."""
    twin = {said(one) for one in findings.get(own["twin"], ())}
    right = {own["kind"], *own["also"]}
    return [
        one
        for one in findings.get(log, ())
        if said(one) not in twin
        and (not named or one["kind"] in right)
        and (own["joint"] is None or one.get("joint") in (None, own["joint"]))
    ]


def said(one: Mapping[str, Any]) -> tuple[str, str | None]:
    """Return what a finding says of which joint."""
    return one["kind"], one.get("joint")


def lies(one: Mapping[str, Any], own: Mapping[str, Any]) -> bool:
    """Tell whether the rows of a finding meet those that were spoilt, in its episode."""
    first, last = one["rows"][0], one["rows"][-1]
    return any(
        first <= spoilt[1] and last >= spoilt[0]
        for episode, spoilt in own["spoilt"].items()
        if one.get("episode") in (None, int(episode))
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("truth", type=Path)
    parser.add_argument("findings", type=Path)
    chosen = parser.parse_args()
    read = [json.loads(path.read_text("utf-8")) for path in (chosen.truth, chosen.findings)]
    sys.stdout.write(json.dumps(score(*read), indent=1) + "\n")
