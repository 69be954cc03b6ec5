"""One command through several simulators: a table and a picture of how far they lie apart."""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidParameter, look_up
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.departure import Departure, departure, replayed
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.simulators import MujocoSimulator, TendonSimulator

OURS = "tendon"  # Our own solver, which all others are measured against
COLORS = ("#1f6f8b", "#b8860b", "#8a3b5c", "#4b7f3a", "#8a8f98")


@dataclass(frozen=True, kw_only=True)
class ModelComparison:
    """What several simulators make of the same commands."""

    recordings: tuple[Recording, ...]
    trajectories: Mapping[str, list[Trajectory]]  # Trajectories by simulator, ours first
    departures: Mapping[str, Departure]  # Departure of every other simulator from ours


def exported_run(
    target: str, way: str
) -> Callable[[Mechanism, Model, Sequence[Recording]], list[Trajectory]]:
    """Return how recordings run through an export."""

    def run(mechanism: Mechanism, model: Model, runs: Sequence[Recording]) -> list[Trajectory]:
        with tempfile.TemporaryDirectory() as folder:
            exported = EXPORTS[target].write(Path(folder), mechanism, model)
            if way not in exported.replays:
                raise InvalidParameter(
                    f"{way} of the target {target} cannot run here: there is "
                    f"{', '.join(exported.replays) or 'no program that runs it'}"
                )
            return replayed(EXPORTS[target], exported, way, model, runs)

    return run


# Simulators beside ours: Newton's SolverMuJoCo under our own servo, then what exports are run by:
# MuJoCo with the program and with its file alone, Newton with the drive and with its own prims
COMPARED: dict[str, Callable[[Mechanism, Model, Sequence[Recording]], list[Trajectory]]] = {
    "solver_mujoco": lambda _, model, runs: MujocoSimulator().simulate(runs, model),
    "mujoco": exported_run("mujoco", "tendon_step.py"),
    "mjcf": exported_run("mujoco", "model.xml alone"),
    "newton": exported_run("newton", "tendon_drive.py"),
    "prims": exported_run("newton", "bench_newton.usda"),
}


def compare(
    names: Sequence[str],
    mechanism: Mechanism,
    model: Model,
    recordings: Sequence[Recording],
    *,
    trust: bool = False,
) -> ModelComparison:
    """Run recordings in our own simulator and in others.

    The others are named as in `COMPARED`; the recordings have commands.

    Raises:
        UnknownName: No such simulator.
        InvalidParameter: One of them cannot hold the model.
    """
    for name in names:
        look_up("simulator", name, COMPARED)
    trajectories = {OURS: TendonSimulator(trust=trust).simulate(recordings, model)}
    for name in names:
        trajectories[name] = COMPARED[name](mechanism, model, recordings)
    return ModelComparison(
        recordings=tuple(recordings),
        trajectories=trajectories,
        departures={
            name: departure(mechanism, trajectories[name], trajectories[OURS]) for name in names
        },
    )


def comparison_table(comparison: ModelComparison) -> str:
    """Return how far the others stray from ours, in Markdown."""
    lines = ["| simulator | motor angle | force | tip |", "|---|---|---|---|"]
    lines += [f"| {name} | {found.text} |" for name, found in comparison.departures.items()]
    return "\n".join(lines)


def plot_comparison(path: Path, comparison: ModelComparison) -> None:
    """Draw angle and force of the first recording's first tendon by all simulators.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    figure = new_figure(10.5, 6.5)
    angle, force = figure.subplots(2, 1, sharex=True)
    run = comparison.recordings[0]
    if run.command is not None:
        angle.step(run.time, run.command[:, 0], where="post", color="#c9ccd2", label="command")
    for place, (name, trajectories) in enumerate(comparison.trajectories.items()):
        style = {"color": COLORS[place % len(COLORS)], "linewidth": 2.4 - 0.4 * min(place, 4)}
        angle.plot(run.time, trajectories[0].motor_position[:, 0], label=name, **style)
        force.plot(run.time, trajectories[0].force[:, 0], **style)
    angle.set_ylabel("motor angle [rad]")
    force.set_ylabel("force [N]")
    force.set_xlabel("time [s]")
    angle.legend(loc="upper right", frameon=False)
    for axes in (angle, force):
        tidy(axes)
        axes.margins(x=0.0)
    figure.suptitle(f"{run.bench}: {run.name}")
    save(figure, path)
