"""What others would do: one law of friction, or a network that learns."""

from collections.abc import Callable, Sequence

import numpy as np
import torch

from lab.studies.cable_tool.perceptron import Rows, train
from lab.studies.cable_tool.runs import Run
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.identification.study import Residual, Study, replacements
from tendon_train.actuator.samples.windows import nearest_rows

BESIDE = ("position_offset", "load_cell_bias")  # Zeros of both signals, which every fit has
PAST = np.array([0.02, 0.04, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0])
"""How long ago the spindle's angles are that the network sees beside the present one [s]."""


def fitted_law(
    frictions: Sequence[str], start: Model, train: Sequence[Run], test: Sequence[Run]
) -> list[Residual]:
    """Return the residuals of test runs [rad, N] by friction at the spindle and a stiff cable."""
    effects = (*BESIDE, *frictions)
    study = Study([run.recording for run in train], start, effects)
    worlds = SearchWorlds(study)
    found = fit_set_anew(worlds, start, effects)
    held = Study([run.recording for run in test], start, effects, like=study)
    return held.residuals(*replacements([values_of(worlds, found.columns, found.place)]))


def learned(train_runs: Sequence[Run], test: Sequence[Run], *, seed: int) -> list[Residual]:
    """Return the residuals of test runs [rad, N] by two networks, one for each signal.

    They see the spindle's angle, by how much it was another at each instant of the last second, and
    the load on the jaw.
    """
    torch.set_num_threads(1)
    said: list[list[Array]] = []
    for signal in (force_of, angle_of):
        network = train(rows_of([run.recording for run in train_runs], signal), seed)
        with torch.no_grad():
            said.append(
                [
                    network(torch.tensor(inputs_of(r.recording), dtype=torch.float32)).numpy()[:, 0]
                    for r in test
                ]
            )
    return [
        Residual(
            signals={
                "theta": (angle_of(run.recording) - angle)[None, None],
                "force": (force_of(run.recording) - force)[None, None],
            },
            trusted=np.ones(run.recording.sample_count, dtype=np.bool_),
        )
        for run, force, angle in zip(test, *said, strict=True)
    ]


def rows_of(recordings: Sequence[Recording], signal: Callable[[Recording], Array]) -> Rows:
    """Gather what a network sees and should say."""
    inputs = np.concatenate([inputs_of(recording) for recording in recordings])
    wanted = np.concatenate([signal(recording) for recording in recordings])
    return Rows(
        inputs=torch.tensor(inputs, dtype=torch.float32),
        wanted=torch.tensor(wanted, dtype=torch.float32),
    )


def inputs_of(recording: Recording) -> Array:
    """Return what a network sees at each row, shape (T, P)."""
    assert recording.joint_load is not None
    angle = recording.motor_position[:, 0]
    past = angle[nearest_rows(recording.time, recording.time[:, None] - PAST)]
    columns = [angle, *(angle[:, None] - past).T, 10.0 * recording.joint_load]
    return np.column_stack(columns)


def force_of(recording: Recording) -> Array:
    """Return the force at the spindle [N], shape (T,)."""
    assert recording.force is not None
    return recording.force[:, 0]


def angle_of(recording: Recording) -> Array:
    """Return the jaw's angle [rad], shape (T,)."""
    return recording.compared_angle
