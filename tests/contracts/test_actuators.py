"""What every actuator of the table promises; a new entry is tested unasked."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
import warp as wp

from tendon_newton.actuators import ACTUATORS, find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.device_code.placeholders import (
    DeviceArray,
    Jet,
    JointVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.structs import Mechanism
from tendon_newton.device_code.templates import device_template
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.hosts.replay import rollout_of
from tendon_newton.simulation.hosts.rollout import Stepping, Trajectory
from tendon_newton.simulation.model.assembly import assemble
from tendon_newton.simulation.tendons.routes import located
from tendon_newton.simulation.tendons.states import flow_at
from tendon_newton.simulation.tendons.world_drive import world_drive
from tests.made import stated_model
from tests.physics.learned.networks import force_network, write_force_network
from tests.physics.runs import RADIUS, led, run_of, stairs

FORCES = [name for name, actuator in ACTUATORS.items() if not actuator.kinematic]
"""Actuators that give a force, not a position."""
ON_A_FINGER = {"pd_torque": {"kp": 0.05, "kd": 0.002, "max_torque": 0.25, "armature": 1.0e-5}}
"""Numbers in place of typical ones, where those of a leg would tear at the finger."""
NUDGE = 1.0e-6  # rad, rad/s


@pytest.fixture(scope="module")
def network_path(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A force network that this process trusts."""
    folder = tmp_path_factory.mktemp("network")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(folder))
        yield write_force_network(folder / "force.pt", force_network())


def typical_model(kind: str, network_path: Path) -> Model:
    """Return an actuator with its typical numbers."""
    values: dict[str, float | str] = {p.name: p.nominal for p in ACTUATORS[kind].parameters}
    values |= ON_A_FINGER.get(kind, {})
    if kind in FORCES:
        values["spool_radius"] = RADIUS
    if ACTUATORS[kind].held:
        values["file"] = str(network_path)
    return stated_model(kind, values)


def runs_of(kind: str) -> list[Recording]:
    """Return two short runs of different lengths on a bench for the actuator."""
    rng = np.random.default_rng(5)
    paths = [stairs(rng, 41, 1.0, 4.0, 12), stairs(rng, 60, 1.0, 4.0, 17)]
    if ACTUATORS[kind].leads:
        return [led(path, np.full(len(path), -2.0)) for path in paths]
    bench = "finger" if kind in FORCES else "servo"
    return [run_of(path, bench=bench) for path in paths]


def replayed(kind: str, recordings: list[Recording], network_path: Path) -> list[Trajectory]:
    """Replay recordings of one bench."""
    model = typical_model(kind, network_path)
    mechanism = load_mechanism(recordings[0].bench)
    stepping = Stepping(time_step=5e-4)
    rollout = rollout_of(mechanism, recordings, model, stepping=stepping, device="cpu")
    return rollout.run(rollout.base_vectors(model)[None])[0]


@pytest.mark.parametrize("kind", ACTUATORS)
def test_an_actuator_says_what_it_is(kind: str) -> None:
    """Equation and source stand in its docstring, each number has a source."""
    actuator = find_actuator(kind)
    for part in (".. math::", "Source:"):
        assert part in (actuator.__doc__ or "")
    module = importlib.import_module(f"tendon_newton.actuators.{kind}")
    assert actuator.__module__ == module.__name__
    assert actuator.name == kind
    for parameter in actuator.parameters:
        assert parameter.source


@pytest.mark.parametrize("kind", ACTUATORS)
def test_a_batch_is_a_loop_of_the_right_shape(kind: str, network_path: Path) -> None:
    """Recordings together or one by one give the same (a network sums in another order)."""
    recordings = runs_of(kind)
    together = replayed(kind, recordings, network_path)
    tolerance = 1e-4 if ACTUATORS[kind].held else 0.0
    for recording, run in zip(recordings, together, strict=True):
        (alone,) = replayed(kind, [recording], network_path)
        assert run.motor_position.shape == run.force.shape == (len(recording.time), 1)
        np.testing.assert_allclose(
            run.motor_position, alone.motor_position, atol=tolerance, rtol=0.0
        )
        np.testing.assert_allclose(run.force, alone.force, atol=10.0 * tolerance, rtol=0.0)
    assert np.ptp(together[0].motor_position) > 0.01


@pytest.mark.parametrize("kind", FORCES)
def test_a_reset_leaves_nothing_over(kind: str, network_path: Path) -> None:
    """A world that begins anew is a fresh one, to the last bit."""
    # a slider compiles in half the time; other tests have loops of a finger with the first two
    bench = "finger" if kind in ("ideal", "learned") else "spring_weak"
    loop = ControlLoop(load_mechanism(bench), typical_model(kind, network_path), 2, device="cpu")
    commands = torch.tensor(stairs(np.random.default_rng(5), 12, 1.0, 4.0, 3), dtype=torch.float32)

    def run() -> torch.Tensor:
        return torch.stack([loop.step(c.expand(2, 1)).force[1].clone() for c in commands])

    loop.reset(commands[0].expand(2, 1))
    first = run()
    loop.reset(commands[0].expand(2, 1), torch.tensor([False, True]))
    assert torch.equal(run(), first)
    assert float(first.std()) > 0.01


@device_template
def pull_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    command: real,
    q: DeviceArray[JointVector],
    v: DeviceArray[JointVector],
    pull: DeviceArray[Jet],
) -> None:
    """Write the pull [N] of the first tendon and its derivatives."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    drive = world_drive(mechanism, 0, parameters[0])
    drive.command[0] = command
    here = located(mechanism, drive, q[i], v[i])
    flow = flow_at(mechanism, parameters[0], here, 0, real(0.0))
    pull[i] = flow.pull


@pytest.mark.parametrize("kind", FORCES)
def test_the_derivatives_of_a_force_are_right(kind: str, network_path: Path) -> None:
    """By excursion and its rate, against central differences (float64: 1e-6)."""
    model = typical_model(kind, network_path)
    mechanism = load_mechanism("finger")
    rollout = rollout_of(mechanism, runs_of(kind)[:1], model, device="cpu")
    structure = rollout.kernels.structure
    kernel = assemble(structure).kernel(pull_kernel)
    types = rollout.kernels.types
    q = 0.3 + NUDGE * np.array([[0, 0], [1, 0], [-1, 0], [0, 0], [0, 0]])
    v = 0.2 + NUDGE * np.array([[0, 0], [0, 0], [0, 0], [1, 0], [-1, 0]])
    pull = wp.zeros(5, dtype=types[Jet], device="cpu")
    parameters = rollout.array(rollout.base_vectors(model), types[ParameterVector])
    spools = np.zeros((5, structure.spool_count))  # none leads its mechanism
    joints = [rollout.array(np.hstack([values, spools]), types[JointVector]) for values in (q, v)]
    wp.launch(
        kernel, 5, inputs=[rollout.numbers, parameters, 1.0, *joints], outputs=[pull], device="cpu"
    )
    found = pull.numpy()
    arm = mechanism.tendons[0].moment_arm[0]
    slopes = [(found[k, 0] - found[k + 1, 0]) / (2.0 * NUDGE * arm) for k in (1, 3)]
    assert found[0, 1:] == pytest.approx(slopes, rel=1e-6, abs=1e-4)
