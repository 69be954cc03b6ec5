"""What the pay-out rule is worth: one policy, the same weights, with other cards.

``python -m lab.studies.policy_pay_out POLICY --out DIR`` lets it climb on virtual benches, new
ones and some with a gear that has run dry, with commands that end at -0.4 rad everywhere, and with
the rule and several least commands. ``pay_out.md`` has the table.
"""

import argparse
import contextlib
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx

from tendon_newton.cli import main as run_verb
from tendon_newton.data.cards.policy_card import CARD_KEY, PolicyCard

RULE = (0.0, 0.05)  # rad
CARDS: dict[str, tuple[float, tuple[float, float] | None]] = {
    "-0.4 rad everywhere": (-0.4, None),
    "-0.4 rad while wound in": (-0.4, RULE),
    "-0.8 rad while wound in": (-0.8, RULE),
    "-1.2 rad while wound in": (-1.2, RULE),
    "-1.6 rad while wound in": (-1.6, RULE),
}
"""Least command [rad] and pay-out rule, by name."""
STATES = ("new", "friction")
FIGURES = ("rmse", "rising_rmse", "falling_rmse")


def main() -> None:
    """Climb and write the table."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("policy", type=Path)
    words.add_argument("--out", type=Path, required=True)
    words.add_argument("--units", nargs="+", type=int, default=[0, 1, 2, 3, 4])
    told = words.parse_args()
    lines = [
        "| a command ends at | tip error, RMS | closing, opening | gear run dry | closing, opening "
        "| least motor angle |",
        "|---|---|---|---|---|---|",
    ]
    for place, (name, (least, rule)) in enumerate(CARDS.items()):
        folder = told.out / f"card_{place}"
        folder.mkdir(parents=True, exist_ok=True)
        policy = with_card(told.policy, folder / "policy.onnx", least, rule)
        climbs = {s: [climb(policy, unit, s) for unit in told.units] for s in STATES}
        lines.append(f"| {name} | {' | '.join(cells(climbs[s]) for s in STATES)} | {low(climbs)} |")
        print(lines[-1], flush=True)
    (told.out / "pay_out.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def with_card(source: Path, path: Path, least: float, rule: tuple[float, float] | None) -> Path:
    """Write a policy with another least command [rad] and another rule on its card."""
    model = onnx.load(source)
    (entry,) = [entry for entry in model.metadata_props if entry.key == CARD_KEY]
    card = PolicyCard.from_json(entry.value)
    limits = (least, card.command_range[1])
    entry.value = replace(card, command_range=limits, pay_out=rule).to_json()
    onnx.save(model, path)
    return path


def climb(policy: Path, unit: int, state: str) -> dict[str, Any]:
    """Let a policy climb on a unit, and return its figures."""
    out = policy.parent / f"unit_{unit}_{state}"
    if not (out / "evaluation.json").exists():
        with contextlib.redirect_stdout(io.StringIO()):
            run_verb(
                [
                    "evaluate-policy",
                    str(policy),
                    "--port",
                    f"virtual:finger:{unit}:{state}",
                    "--out",
                    str(out),
                    "--faster-than-real-time",
                    "--no-plots",
                    "--force",
                ]
            )
    (found,) = json.loads((out / "evaluation.json").read_text())["climbs"]
    return found


def cells(climbs: list[dict[str, Any]]) -> str:
    """Return median and range, and the medians of closing and opening [mm]."""
    rms, closing, opening = (1e3 * np.array([c[figure] for c in climbs]) for figure in FIGURES)
    return (
        f"{np.median(rms):.1f} mm ({rms.min():.1f} to {rms.max():.1f}) | "
        f"{np.median(closing):.1f}, {np.median(opening):.1f}"
    )


def low(climbs: dict[str, list[dict[str, Any]]]) -> str:
    """Return the least angle of the motor in all climbs."""
    return f"{min(c['least_motor_angle'] for own in climbs.values() for c in own):.2f} rad"


if __name__ == "__main__":
    main()
