"""Extrapolation: trained on the weak spring and the finger, tested on the strong spring."""

from __future__ import annotations

from train.reproduction.outcome import Outcome, row
from train.reproduction.parts import WITHOUT_STRONG, force_errors, learned_from
from train.reproduction.reproduction import BEST, IDEALS, MODELS, Reproduction

UNSEEN = "spring_strong"


def run(reproduction: Reproduction) -> Outcome:
    """Replay the strong spring's steps with models that have seen it, and that have not."""
    (without,) = reproduction.each(blind_errors, [WITHOUT_STRONG])
    known = (*IDEALS, *BEST)
    seen = dict(zip(known, reproduction.each(seen_errors, known), strict=True))
    where = "strong spring, steps, closed loop"
    rows = [
        *(
            row(where, f"{MODELS[m]}, trained with it: force RMSE", "N", seen[m], over="holds")
            for m in seen
        ),
        *(
            row(where, f"{MODELS[m]}, never seen: force RMSE", "N", without[m], over="holds")
            for m in BEST
        ),
    ]
    return Outcome(rows=tuple(rows), numbers={"seen_n": seen, "unseen_n": without})


def seen_errors(reproduction: Reproduction, model: str) -> list[float]:
    """Return the errors of a model that has seen the spring [N]."""
    unit = reproduction.units[0]
    return force_errors(reproduction, unit.steps(UNSEEN), reproduction.model(unit, model))


def blind_errors(reproduction: Reproduction, part: str) -> dict[str, list[float]]:
    """Return the errors [N] of models that have not."""
    steps = reproduction.units[0].steps(UNSEEN)
    models = learned_from(reproduction, part)
    return {name: force_errors(reproduction, steps, model) for name, model in models.items()}
