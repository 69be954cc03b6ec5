"""Made-up diagnoses of each kind, and evidence to show beside them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import Model, NamedValues, load_model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnose import Evidence
from tendon_newton.diagnosis.result import (
    CandidateScore,
    Diagnosis,
    Errors,
    Estimate,
    NamedEffect,
    Unexplained,
    Verdict,
)
from tendon_newton.diagnosis.unexplained.remainder_structure import Profile, RemainderStructure
from tendon_newton.effects import EFFECTS, find_effect
from tendon_newton.identification.study import Study

EXAMPLE = Path(__file__).parents[2] / "examples" / "hidden_friction"
SECONDS = 5.0  # [s] of each recording; enough for a window, and short to simulate
COEFFICIENT = 0.810  # [N s/rad] hidden in the example
VERDICTS: tuple[Verdict, ...] = ("no_gap", "explained", "partly_explained", "unexplained")


def beginning(recording: Recording, *, force: bool) -> Recording:
    """Return a recording's first seconds."""
    rows = recording.time <= recording.time[0] + SECONDS
    return replace(
        recording,
        time=recording.time[rows],
        command=recording.command[rows],
        motor_position=recording.motor_position[rows],
        motor_velocity=recording.motor_velocity[rows],
        force=recording.force[rows] if force else None,
        enabled=recording.enabled[rows],
        tip=None,
    )


def evidence(*, force: bool = True, bench: str = "spring") -> Evidence:
    """Simulate held-out recordings of the example without and with its friction.

    Args:
        force: Whether they have a load cell's force.
        bench: Beginning of the names of the benches: two springs, or the finger.
    """
    dataset, model = load_dataset(EXAMPLE), load_model(EXAMPLE / "model.toml")
    chosen = [beginning(r, force=force) for r in dataset.test if r.bench.startswith(bench)]
    study = Study(chosen, model, ("viscous_friction",), time_step=1e-3)
    (column,) = study.table.columns("viscous_friction")
    return Evidence(baseline={}, extended={column: COEFFICIENT}, test=study, train=study)


def named(effect: str, value: float | None = None, **changes: Any) -> NamedEffect:
    """A cause whose parameters are at their typical size, or the first at ``value``."""
    parameters = {
        p.name: Estimate(value=p.nominal, ci95=(0.98 * p.nominal, 1.02 * p.nominal), unit=p.unit)
        for p in find_effect(effect).parameters
    }
    if value is not None:
        first = next(iter(parameters))
        parameters[first] = replace(parameters[first], value=value, ci95=(value, value))
    cause = NamedEffect(
        name=effect,
        side=find_effect(effect).side,
        parameters=parameters,
        without=Errors(force_rmse=0.9, theta_rmse=0.3, theta_mae=0.2),
    )
    return replace(cause, **changes)


def structure() -> RemainderStructure:
    """A made-up ripple over the motor angle."""
    x = np.linspace(0.0, 3.0, 20)
    ripple = Profile(
        signal="theta", center=x, mean=np.sin(9.0 * x), error=0.1 + 0.0 * x, learned=np.sin(9.0 * x)
    )
    return RemainderStructure(
        side="servo",
        found=True,
        held_out_r2=0.8,
        p_value=1.0 / 61.0,
        size=0.7,
        importance={"theta": 1.0, "t": 0.3},
        profiles=(ripple, replace(ripple, signal="t")),
    )


def diagnosis(verdict: Verdict) -> Diagnosis:
    """A made-up diagnosis of each kind."""
    causes = {
        "explained": (named("viscous_friction", COEFFICIENT),),
        "partly_explained": (
            named(
                "viscous_friction",
                COEFFICIENT,
                indistinguishable_from=("actuator_lag",),
                separating_experiment="Record steps.",
            ),
            named("command_delay", 0.0229),
        ),
    }.get(verdict, ())
    quiet = Errors(force_rmse=0.051, theta_rmse=0.0005, theta_mae=0.0004)
    loud = Errors(force_rmse=0.9, theta_rmse=0.3, theta_mae=0.2)
    effects = tuple(
        NamedValues(name=c.name, values={n: p.value for n, p in c.parameters.items()})
        for c in causes
    )
    rest = verdict in ("partly_explained", "unexplained")
    scores = np.linspace(0.99, -0.3, len(EFFECTS))
    return Diagnosis(
        verdict=verdict,
        wall_time_s=9.7,
        baseline=quiet if verdict == "no_gap" else loud,
        extended=loud if verdict == "unexplained" else quiet,
        noise_force=0.05,
        noise_theta=0.00044,
        explained_fraction=0.97 if causes else 0.0,
        explained_interval=(0.95, 0.98),
        effects=causes,
        candidates=tuple(
            CandidateScore(name=n, score=float(s), values={})
            for n, s in zip(EFFECTS, scores, strict=True)
        ),
        unexplained=Unexplained(
            fraction=0.03,
            depends_on=("theta", "t") if rest else (),
            structure=structure() if rest else None,
        ),
        model=Model(
            actuator=NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125}),
            effects=effects,
        ),
        notes=("Something <odd> & unusual.",),
    )
