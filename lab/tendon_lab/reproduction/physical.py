"""The physical model: what a diagnosis names on a bench's recordings, and how much of it there."""

from collections.abc import Callable

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.diagnosis.diagnose import diagnose, extended_model
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.diagnosis.search.fixed_set import fit_set
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.identification.study import Study

SPOOL_RADIUS = 0.0125  # [m], of the paper
DATA_SHEET = {
    "duty_per_rad": 0.10,
    "max_duty": 0.90,
    "supply_voltage": 9.0,
    "torque_constant": 1.43,
    "resistance": 15.0,
    "armature": 0.0025,
    "spool_radius": SPOOL_RADIUS,
}
"""What is known of the paper's servo before anything is measured: the position loop of its host,
and the row of 9.0 V in the e-manual of the XC330-T288-T. The rotor's inertia is a guess."""
UNKNOWN = ("torque_constant", "resistance")  # Numbers of it that every fit may change


def starting_model() -> Model:
    """Return the servo's data sheet."""
    return Model(actuator=NamedValues(name="pwm_servo", values=DATA_SHEET), fit=UNKNOWN)


def diagnose_in_passes(
    dataset: Dataset, passes: int, progress: Callable[[str], None]
) -> tuple[Model, tuple[Diagnosis, ...]]:
    """Diagnose, and go on from the extended model until nothing more is named.

    Returns:
        The extended model, and the diagnoses.
    """
    model, found = starting_model(), []
    for _ in range(passes):
        diagnosis, _ = diagnose(dataset, model, progress=progress)
        found.append(diagnosis)
        if not diagnosis.effects:
            break
        model = diagnosis.model
    return model, tuple(found)


def refit(dataset: Dataset, model: Model) -> Model:
    """Return a model with its causes as they are and their numbers fitted to other recordings."""
    names = tuple(effect.name for effect in model.effects)
    study = Study(dataset.train, model, names, time_step=SEARCH_STEP, tolerant=True)
    worlds = SearchWorlds(study)
    found = fit_set(worlds, model, names)
    values = values_of(worlds, found.columns, found.place)
    return extended_model(study, model, values, names)


def with_ideal(gain: float) -> Model:
    """Return the ideal source and nothing else."""
    values = {"gain": gain, "spool_radius": SPOOL_RADIUS}
    return Model(actuator=NamedValues(name="ideal", values=values))
