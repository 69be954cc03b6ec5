"""Extrapolation: trained on free motion alone, tested in contact."""

from __future__ import annotations

from tendon_newton.data.recording import Recording
from train.reproduction.closed_loop import OBSTACLES
from train.reproduction.outcome import Outcome, row
from train.reproduction.parts import FREE, force_errors, learned_from
from train.reproduction.reproduction import BEST, IDEALS, MODELS, Reproduction

TEXT = (
    "Every model is given the obstacle, with its place and its stiffness; the servo differs. "
    "The physical model is fitted to free motion in both columns."
)


def run(reproduction: Reproduction) -> Outcome:
    """Replay ramps onto obstacles with models that know contact, and that do not."""
    (without,) = reproduction.each(free_errors, [FREE])
    known = (*IDEALS, *BEST)
    seen = dict(zip(known, reproduction.each(contact_errors, known), strict=True))
    where = "ramps onto tape roll and hand, closed loop"
    rows = [
        *(
            row(
                where,
                f"{MODELS[m]}, trained with contact: force RMSE",
                "N",
                seen[m],
                over="obstacles",
            )
            for m in seen
        ),
        *(
            row(where, f"{MODELS[m]}, trained free: force RMSE", "N", without[m], over="obstacles")
            for m in BEST
        ),
    ]
    return Outcome(rows=tuple(rows), numbers={"seen_n": seen, "unseen_n": without}, text=TEXT)


def ramps(reproduction: Reproduction) -> list[Recording]:
    """Return the first bench's ramps onto obstacles."""
    return [reproduction.units[0].find("finger", f"contact_ramp_{name}") for name in OBSTACLES]


def contact_errors(reproduction: Reproduction, model: str) -> list[float]:
    """Return the errors of a model that has learned from all recordings [N]."""
    own = reproduction.model(reproduction.units[0], model)
    return force_errors(reproduction, ramps(reproduction), own)


def free_errors(reproduction: Reproduction, part: str) -> dict[str, list[float]]:
    """Return the errors [N] of models that have learned from free motion alone."""
    recordings = ramps(reproduction)
    models = learned_from(reproduction, part)
    return {name: force_errors(reproduction, recordings, own) for name, own in models.items()}
