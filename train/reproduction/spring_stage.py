"""Extrapolation: trained on the weak spring and the finger, tested on the strong spring."""

from __future__ import annotations

from train.reproduction.learned_from import force_errors, learned_from
from train.reproduction.outcome import Outcome, row
from train.reproduction.reproduction import BEST, IDEALS, MODELS, Reproduction
from train.reproduction.unit import of_benches

UNSEEN = "spring_strong"
SEEN = ("finger", "spring_weak")


def run(reproduction: Reproduction) -> Outcome:
    """Replay the strong spring's steps with models that have seen it, and that have not."""
    unit = reproduction.units[0]
    steps = unit.steps(UNSEEN)
    part = of_benches(unit.dataset, SEEN)
    blind = learned_from(reproduction, unit, part, "without_strong")
    without = {m: force_errors(reproduction, steps, blind[m]) for m in BEST}
    seen = {
        m: force_errors(reproduction, steps, reproduction.model(unit, m)) for m in (*IDEALS, *BEST)
    }
    where = "strong spring, steps, closed loop"
    rows = [
        *(row(where, f"{MODELS[m]}, trained with it: force RMSE", "N", seen[m], over="holds")
          for m in seen),
        *(row(where, f"{MODELS[m]}, never seen: force RMSE", "N", without[m], over="holds")
          for m in BEST),
    ]  # fmt: skip
    return Outcome(rows=tuple(rows), numbers={"seen_n": seen, "unseen_n": without})
