"""What a diagnosis says, and its JSON: the fields say what its keys mean."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tendon_newton.actuators import find_actuator
from tendon_newton.data.files.html_table import html_table
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.picture import new_figure, tidy
from tendon_newton.data.files.together import together, with_hashes
from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.plain_numbers import estimate_text, number
from tendon_newton.data.servo_names import effect_of, servo_of
from tendon_newton.diagnosis.explanation import Estimate, Setting
from tendon_newton.diagnosis.identifiability import Confounded
from tendon_newton.diagnosis.posterior import Posterior, write_posterior
from tendon_newton.diagnosis.unexplained.remainder_structure import RemainderStructure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Diagnosis", "Errors", "Estimate", "NamedEffect", "Verdict", "write_diagnosis"]

Verdict = Literal["no_gap", "explained", "partly_explained", "unexplained"]
SCHEMA = 1


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Held-out closed-loop errors, pooled over all rows of the test recordings."""

    force_rmse: float | None  # [N]; None without a load cell
    theta_rmse: float  # [rad]
    theta_mae: float  # Mean absolute error [rad]
    others_rmse: Mapping[str, float] = field(default_factory=dict[str, float])
    """Those of further signals that were recorded, each in its unit."""

    def of(self, signal: str) -> float | None:
        """Return the RMS error of one signal, in its unit; None where it was not recorded."""
        sizes = {"theta": self.theta_rmse, "force": self.force_rmse, **self.others_rmse}
        return sizes.get(signal)

    def to_json(self) -> dict[str, Any]:
        """Return them for ``diagnosis.json``; of signals that were not recorded nothing."""
        others = {"others_rmse": dict(self.others_rmse)} if self.others_rmse else {}
        return {"force_rmse": self.force_rmse, "theta_rmse": self.theta_rmse,
                "theta_mae": self.theta_mae, **others}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """One thing that a cause must pass to be named."""

    name: str  # What is asked
    value: float  # What the data say
    bar: float  # What it is compared with
    passed: bool

    def to_json(self) -> dict[str, Any]:
        """Return it for ``diagnosis.json``."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class NamedEffect:
    """A cause that passed what is asked."""

    name: str
    side: str
    parameters: Mapping[str, Estimate]
    without: Errors  # Held-out errors of the model without it, everything else as found
    indistinguishable_from: tuple[str, ...] = ()  # Effects that this data cannot tell from it
    separating_experiment: str | None = None  # What to record to tell them apart
    criteria: tuple[Criterion, ...] = ()  # What it had to pass
    reason: str = ""  # Why it is only suspected, as a sentence; empty for a named cause
    probability: float | None = None
    """Weight of all sets of causes that hold it or one of its class; None where nobody asked."""


@dataclass(frozen=True, kw_only=True)
class ActuatorFound:
    """A servo that says more than that of the starting model, and explains more."""

    stated: str  # Kind of the starting model's actuator
    kind: str  # Kind of the found model's, which may be the same with other numbers
    parameters: Mapping[str, Estimate]  # Numbers that were fitted for it
    without: Errors  # Held-out errors of the best answer with the actuator as it was stated

    @property
    def sentence(self) -> str:
        """What was wrong with the actuator, without its full stop."""
        said = ", ".join(
            f"{name.replace('_', ' ')} {estimate_text(self.kind, name, estimate)[0]}"
            for name, estimate in self.parameters.items()
        )
        if self.kind == self.stated:
            return f"The servo is another {self.kind} than the model's: {said}"
        return (
            f"The actuator {self.stated} is too simple. A {self.kind}, which has a rotor and "
            f"back EMF, explains more: {said}"
        )

    def to_json(self, extended: Errors) -> dict[str, Any]:
        """Return it as `NamedEffect` is returned."""
        return {
            "stated": self.stated,
            "kind": self.kind,
            "parameters": {name: value.to_json() for name, value in self.parameters.items()},
            "gain": gain_json(self.without, extended),
        }


@dataclass(frozen=True, kw_only=True)
class CandidateScore:
    """How one effect did when tried alone on the starting model."""

    name: str
    score: float
    """Share of the squared error above the noise that it removes from the recordings fitted."""
    values: Mapping[str, float]
    at_bound: Mapping[str, float] = field(default_factory=dict)
    """Numbers that ended at a bound, with that bound: it cannot be named, whatever its score."""
    criteria: tuple[Criterion, ...] = ()  # What it passed and what it did not
    acts_in: tuple[str, ...] | None = None
    """Recordings in which it changes more than is left over anyway; None where nobody looked."""
    looked_at: int = 0  # Recordings in which that was looked at

    def to_json(self) -> dict[str, Any]:
        """Return it for ``diagnosis.json``; what is not the case is left out.

        JSON has no infinity: a number at an infinite null is left out.
        """
        finite = {name: value for name, value in self.values.items() if math.isfinite(value)}
        out: dict[str, Any] = {"name": self.name, "score": self.score, "parameters": finite}
        if self.at_bound:
            out["at_bound"] = list(self.at_bound)
        if self.acts_in is not None:
            out |= {"acts_in": list(self.acts_in), "looked_at": self.looked_at}
        return {**out, **account_json(self.criteria)}


@dataclass(frozen=True, kw_only=True)
class Rival:
    """One whole answer, and how well it predicts what it was not fitted on."""

    name: str  # What it is called
    effects: tuple[str, ...]
    held_out: float
    """Negative log likelihood per row of training parts that no number has seen [nat]: the choice
    is made by it."""
    errors: Errors  # On the held-out recordings, which choose nothing
    chosen: bool = False  # Whether the diagnosis gives this one

    def to_json(self) -> dict[str, Any]:
        """Return it for ``diagnosis.json``."""
        return {
            "name": self.name,
            "effects": list(self.effects),
            "held_out_score": self.held_out,
            **self.errors.to_json(),
            "chosen": self.chosen,
        }


@dataclass(frozen=True, kw_only=True)
class Unexplained:
    """What remains when all named effects are in."""

    fraction: float  # Share of the held-out squared error above the noise
    depends_on: tuple[str, ...] = ()  # Signals that it depends on, strongest first
    structure: RemainderStructure | None = None
    """What a flexible learner makes of it; none where the verdict leaves nothing to look for."""

    def to_json(self) -> dict[str, Any]:
        """Return it for ``diagnosis.json``, and what was learned besides."""
        out: dict[str, Any] = {"fraction": self.fraction, "depends_on": list(self.depends_on)}
        return out if self.structure is None else {**out, "structure": self.structure.to_json()}


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The answer to: what does this model get wrong about these recordings?"""

    verdict: Verdict
    wall_time_s: float
    baseline: Errors
    extended: Errors
    noise_force: float | None
    """Noise of the load cell [N]."""
    noise_theta: float
    """Noise of the encoder [rad]."""
    explained_fraction: float
    """Share of the held-out squared error above the noise that the named effects remove."""
    explained_interval: tuple[float, float]
    """95 % block-bootstrap interval of it."""
    effects: tuple[NamedEffect, ...]
    """Named causes, those that explain most first."""
    candidates: tuple[CandidateScore, ...]
    unexplained: Unexplained
    model: Model
    """The extended model."""
    actuator: ActuatorFound | None = None
    """What was wrong with the actuator itself; None where it is as it was stated."""
    noise_others: Mapping[str, float] = field(default_factory=dict[str, float])
    """Noise of further signals that were recorded, each in its unit."""
    suspected: tuple[NamedEffect, ...] = ()
    """Causes that help to predict unseen parts, though their intervals hold the value that means
    nothing: they are in the model, and no name is deserved."""
    rivals: tuple[Rival, ...] = ()
    """The answer beside plain models; none where nothing is left to explain."""
    posterior: Posterior = field(default_factory=Posterior)
    """Sets of causes by their weight, to draw worlds from; in a file of its own."""
    fitted: Mapping[str, Estimate] = field(default_factory=dict)
    """Numbers of the model's ``fit`` list."""
    confounded: tuple[Confounded, ...] = ()
    """Numbers that the data know better together than apart."""
    scale: BenchScale = field(default_factory=BenchScale)
    """How large the benches are beside the nominal ones."""
    start: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Effects of the model that was started from, and their numbers: no cause names them again."""
    recorded: tuple[Setting, ...] = ()
    """Benches of the training data, as they were set up."""
    notes: tuple[str, ...] = ()
    """What the reader must know: sides that could not be tested, defects of the data."""
    servos: int = 1
    """Servos of each bench."""
    finished: bool = True
    """Whether the search came to its end; else causes may be missing."""
    next_steps: tuple[str, ...] = ()
    """What came closest, what stopped it and what to do, where a gap is left."""

    @property
    def separable(self) -> bool:
        """Whether the verb experiment has sets to separate, and names that would change."""
        rivals = any(effect.separating_experiment for effect in self.effects)
        return rivals and len(self.posterior.sets) > 1

    def noise_of(self, signal: str) -> float | None:
        """Return the noise of one signal, in its unit; None where it was not recorded."""
        sizes = {"theta": self.noise_theta, "force": self.noise_force, **self.noise_others}
        return sizes.get(signal)

    def __repr__(self) -> str:
        """Say the verdict, the causes with their numbers, and the held-out error."""
        causes = "; ".join(" ".join(row) for row in self.rows()) or "no cause"
        return f"Diagnosis({self.verdict}: {causes}; {self.change})"

    def _repr_html_(self) -> str:
        """List the causes with their numbers in a notebook."""
        heads = ("cause", "number", "value", "95 % interval")
        title = f"{self.verdict.replace('_', ' ')}; {self.change}"
        return html_table(title, heads, self.rows())

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Return cause, name, value and interval of each number, in words."""
        return [
            (effect.name, name, *estimate_text(effect_of(effect.name), name, estimate))
            for effect in self.effects
            for name, estimate in effect.parameters.items()
        ]

    @property
    def change(self) -> str:
        """How the held-out error of the angle changes, or that of the force on a given path."""
        before, after = self.baseline, self.extended
        if before.theta_rmse or before.force_rmse is None or after.force_rmse is None:
            told = f"{number(1e3 * before.theta_rmse)} to {number(1e3 * after.theta_rmse)} mrad"
            return f"held-out angle error {told} RMS"
        told = f"{number(before.force_rmse)} to {number(after.force_rmse)} {self.scale.force_unit}"
        return f"held-out error of the {self.scale.force_name} {told} RMS"

    def plot(self) -> Figure:
        """Draw held-out errors: of the model as given, without each cause, and with all causes."""
        models = [
            ("with all causes", self.extended),
            *((f"without {effect.name}", effect.without) for effect in reversed(self.effects)),
            ("as given", self.baseline),
        ]
        angles = [1e3 * errors.theta_rmse for _, errors in models]
        sides = [("motor angle [mrad RMS]", angles)] if any(angles) else []
        forces = [errors.force_rmse for _, errors in models if errors.force_rmse is not None]
        if len(forces) == len(models):
            label = f"{self.scale.force_name} [{self.scale.force_unit} RMS]"
            sides.append((label, forces))
        figure = new_figure(4.0 + 3.0 * len(sides), 1.0 + 0.35 * len(models))
        panels = figure.subplots(1, len(sides), sharey=True, squeeze=False)[0]
        for axes, (label, sizes) in zip(panels, sides, strict=True):
            axes.barh([name.replace("_", " ") for name, _ in models], sizes, color="#1f6f8b")
            axes.set_xlabel(label)
            tidy(axes)
        return figure

    @property
    def angle_name(self) -> str:
        """Name of the angle that was compared."""
        return "joint angle" if find_actuator(self.model.actuator.name).leads else "motor angle"

    def to_json(self) -> dict[str, Any]:
        """Return what ``diagnosis.json`` holds."""
        return {
            "schema": SCHEMA,
            "wall_time_s": round(self.wall_time_s, 2),
            "verdict": self.verdict,
            "finished": self.finished,
            "baseline": self.baseline.to_json(),
            "extended": self.extended.to_json(),
            "noise_floor": {
                "force": self.noise_force,
                "theta": self.noise_theta,
                **self.noise_others,
            },
            "explained_fraction": self.explained_fraction,
            "explained_fraction_ci95": list(self.explained_interval),
            "effects": [effect_json(effect, self.extended) for effect in self.effects],
            **({} if self.actuator is None else {"actuator": self.actuator.to_json(self.extended)}),
            "suspected": [effect_json(effect, self.extended) for effect in self.suspected],
            "rivals": [rival.to_json() for rival in self.rivals],
            "candidates": [candidate.to_json() for candidate in self.candidates],
            "unexplained": self.unexplained.to_json(),
            "fitted": {name: value.to_json() for name, value in self.fitted.items()},
            "identifiability": self.identifiability(),
            "scale": asdict(self.scale),
            **({} if self.servos == 1 else {"servos": self.servos}),
            **({"start": {k: dict(v) for k, v in self.start.items()}} if self.start else {}),
            "recorded": [setting.to_json() for setting in self.recorded],
            "notes": list(self.notes),
            "next_steps": list(self.next_steps),
        }

    def identifiability(self) -> dict[str, Any]:
        """Return the numbers that the data did not pin down, as ``effect.parameter``."""
        numbers = {
            f"{owner}.{name}": estimate
            for owner, own in (
                *((effect.name, effect.parameters) for effect in (*self.effects, *self.suspected)),
                (self.model.actuator.name, self.fitted),
            )
            for name, estimate in own.items()
        }
        return {
            "at_bound": [name for name, estimate in numbers.items() if estimate.at_bound],
            "flat": [name for name, estimate in numbers.items() if estimate.flat],
            "confounded": [pair.to_json() for pair in self.confounded],
        }


def effect_json(effect: NamedEffect, extended: Errors) -> dict[str, Any]:
    """Return one named effect for ``diagnosis.json``."""
    return {
        "name": effect.name,
        **({} if (servo := servo_of(effect.name)) is None else {"servo": servo}),
        "side": effect.side,
        "parameters": {name: value.to_json() for name, value in effect.parameters.items()},
        "gain": gain_json(effect.without, extended),
        "indistinguishable_from": list(effect.indistinguishable_from),
        "separating_experiment": effect.separating_experiment,
        **({"reason": effect.reason} if effect.reason else {}),
        **account_json(effect.criteria, effect.probability),
    }


def gain_json(without: Errors, extended: Errors) -> dict[str, Any]:
    """Return held-out errors without a cause and with it."""
    gain: dict[str, Any] = {"theta_rmse": [without.theta_rmse, extended.theta_rmse]}
    if extended.force_rmse is not None:
        gain["force_rmse"] = [without.force_rmse, extended.force_rmse]
    for name in extended.others_rmse:
        gain[f"{name}_rmse"] = [without.of(name), extended.of(name)]
    return gain


def account_json(
    criteria: tuple[Criterion, ...], probability: float | None = None
) -> dict[str, Any]:
    """Return what a cause passed, and its chance; what nobody asked is left out."""
    out: dict[str, Any] = {}
    if criteria:
        out["criteria"] = [criterion.to_json() for criterion in criteria]
    if probability is not None:
        out["probability"] = round(probability, 3)
    return out


def write_diagnosis(path: Path, diagnosis: Diagnosis) -> None:
    """Write ``diagnosis.json``, with what it leaves open and the hashes of files beside it."""
    with together() as drafts:
        write_posterior(path, diagnosis.posterior)
        write_json(path, with_hashes(diagnosis.to_json(), drafts, path.parent))
