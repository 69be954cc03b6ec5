"""Extrapolation: trained on free motion alone, tested in contact."""

from __future__ import annotations

from train.reproduction.closed_loop import OBSTACLES
from train.reproduction.learned_from import force_errors, learned_from
from train.reproduction.outcome import Outcome, row
from train.reproduction.reproduction import BEST, IDEALS, MODELS, Reproduction
from train.reproduction.unit import free_only

TEXT = (
    "Every model is given the obstacle, with its place and its stiffness; the servo differs. "
    "The physical model is fitted to free motion in both columns."
)


def run(reproduction: Reproduction) -> Outcome:
    """Replay ramps onto obstacles with models that know contact, and that do not."""
    unit = reproduction.units[0]
    ramps = [unit.find("finger", f"contact_ramp_{name}") for name in OBSTACLES]
    blind = learned_from(reproduction, unit, free_only(unit.dataset), "free")
    without = {m: force_errors(reproduction, ramps, blind[m]) for m in BEST}
    seen = {
        m: force_errors(reproduction, ramps, reproduction.model(unit, m)) for m in (*IDEALS, *BEST)
    }
    where = "ramps onto tape roll and hand, closed loop"
    rows = [
        *(row(where, f"{MODELS[m]}, trained with contact: force RMSE", "N", seen[m],
              over="obstacles")
          for m in seen),
        *(row(where, f"{MODELS[m]}, trained free: force RMSE", "N", without[m], over="obstacles")
          for m in BEST),
    ]  # fmt: skip
    return Outcome(rows=tuple(rows), numbers={"seen_n": seen, "unseen_n": without}, text=TEXT)
