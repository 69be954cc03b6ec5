"""The sim-to-real experiment: one sinusoid on the bench and in simulation, and the tips' distance.

The paper's sinusoid has an amplitude of pi/2 at 0.5 Hz; its centre is not said. About pi/2 no
command is negative, but by its data sheet the motor hardly follows at the paper's duty. About 0.2
rad the ideal source opens the finger fully, as in the paper.
"""

from collections.abc import Mapping

from tendon_lab.reproduction.closed_loop import tip_errors_of
from tendon_lab.reproduction.outcome import Outcome, Row, reductions, row
from tendon_lab.reproduction.reproduction import BEST, IDEALS, MODELS, Reproduction

SINES = {"open_sine": "about 0.2 rad", "closing_sine": "about pi/2"}
"""Kind of the recording and its centre in words; the first is the one that is compared."""
PAPER_TIP = {"ideal": 14.58, "network": 8.61}  # [mm]
PAPER_REDUCTION = 41.0  # [%]

Errors = dict[str, dict[str, list[float]]]  # Kind -> model -> tip error of each bench [mm]


def run(reproduction: Reproduction) -> Outcome:
    """Replay both sinusoids with every model on every bench."""
    items = [(place, model) for place in range(len(reproduction.units)) for model in MODELS]
    found = reproduction.each(tip_errors, items)
    errors: Errors = {
        kind: {
            model: [own[kind] for (_, name), own in zip(items, found, strict=True) if name == model]
            for model in MODELS
        }
        for kind in SINES
    }
    return Outcome(
        rows=tuple(r for kind in SINES for r in rows_of(kind, errors[kind])),
        numbers={"tip_error_mm": errors, "benches": [unit.name for unit in reproduction.units]},
    )


def tip_errors(reproduction: Reproduction, item: tuple[int, str]) -> dict[str, float]:
    """Replay the sinusoids of a bench with one of its models; return tip errors [mm] by kind."""
    place, model = item
    unit = reproduction.units[place]
    reproduction.tell(f"  {unit.name}: {model}")
    errors = tip_errors_of(
        [unit.find("finger", kind) for kind in SINES],
        reproduction.model(unit, model),
        time_step=reproduction.settings.time_step,
    )
    return {kind: 1.0e3 * error for kind, error in zip(SINES, errors, strict=True)}


def rows_of(kind: str, errors: Mapping[str, list[float]]) -> list[Row]:
    """Return the rows of one sinusoid."""
    where = f"tip, sinusoid {SINES[kind]}"
    compared, less = kind == next(iter(SINES)), reductions(errors, IDEALS)
    rows = [
        row(
            where,
            f"{words}, RMSE",
            "mm",
            errors[model],
            paper=PAPER_TIP.get(model) if compared else None,
        )
        for model, words in MODELS.items()
    ]
    rows += [
        row(
            where,
            f"{MODELS[model]}: less than the better ideal source by",
            "%",
            less[model],
            paper=PAPER_REDUCTION if compared and model == "network" else None,
        )
        for model in BEST
    ]
    return rows
