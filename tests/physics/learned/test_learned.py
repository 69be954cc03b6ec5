"""The learned actuator in the simulator: the force that its network gives, at the right rows."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tendon_newton.actuators.networks.torchscript import TorchScriptQuery
from tendon_newton.cli import main
from tendon_newton.data.cards.force_network_card import PLAIN_HOLD, HoldLaw
from tendon_newton.data.formats.csv_file import write_csv
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidParameter
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.hosts.network_source import NetworkSource
from tendon_newton.simulation.hosts.query_rows import query_table, with_queries
from tendon_newton.simulation.hosts.replay import replay as replay_in_closed_loop
from tendon_newton.simulation.hosts.rollout import Rollout, Stepping, Trajectory
from tendon_newton.simulation.hosts.timeline import make_timeline
from tests.bad_input.damage import refusal
from tests.physics.learned.networks import (
    EFFECTS,
    HOLD,
    LIMIT,
    RATE,
    WINDOW,
    force_network,
    force_query,
    learned_model,
    write_force_network,
)
from tests.physics.runs import RADIUS, ROWS, run_of, simulate, stairs

STRIDE = round(ROWS / RATE)


def replay(recordings: list[Recording], **effects: dict[str, float]) -> list[Trajectory]:
    """Replay with the network of `force_query`."""
    model = learned_model(**effects)
    rollout = Rollout(
        load_mechanism("finger"),
        recordings,
        model,
        force=NetworkSource(force_query()),
        stepping=Stepping(time_step=5e-4),
        device="cpu",
    )
    return rollout.run(rollout.base_vectors(model)[None])[0]


def windows_of(recording: Recording, run: Trajectory) -> torch.Tensor:
    """Return what the network saw in every query of a run, shape (Q, H, 3)."""
    assert recording.command is not None
    rows = np.stack([recording.command, run.motor_position, run.motor_velocity], axis=2)
    samples = rows[::STRIDE, 0].astype(np.float32)
    padded = np.concatenate([np.repeat(samples[:1], WINDOW - 1, axis=0), samples])
    windows = np.lib.stride_tricks.sliding_window_view(padded, WINDOW, axis=0)
    return torch.tensor(windows.transpose(0, 2, 1).copy())


@pytest.fixture
def recordings(rng: np.random.Generator) -> list[Recording]:
    """One run from equilibrium and one in motion, of different lengths."""
    return [
        run_of(stairs(rng, 161, 1.0, 5.0, 20)),
        run_of(stairs(rng, 122, 1.0, 4.0, 33), start="first_row", angle=0.6, speed=0.5),
    ]


@pytest.mark.parametrize("hold", [PLAIN_HOLD, HOLD], ids=["plain", "answering"])
def test_the_force_is_what_the_network_says_of_the_log(
    hold, recordings, tmp_path, monkeypatch
) -> None:
    """Fed with the log's own rows at its rate, the module gives the log's force: 1e-5 N.

    In the rows between, the force is held, or answers to the shaft as its card says.
    """
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    network = force_network()
    model = learned_model(str(write_force_network(tmp_path / "force.pt", network, hold=hold)))
    runs = replay_in_closed_loop(recordings, model, time_step=5e-4)
    for recording, run in zip(recordings, runs, strict=True):
        with torch.no_grad():
            said = network(windows_of(recording, run)).clamp(0.0, LIMIT).numpy()
        assert run.force[::STRIDE, 0] == pytest.approx(said, abs=1e-5)
        assert np.ptp(run.force) > 0.3
        asked = np.arange(len(run.force)) // STRIDE * STRIDE
        turned = run.motor_position[:, 0] - run.motor_position[asked, 0]
        faster = run.motor_velocity[:, 0] - run.motor_velocity[asked, 0]
        between = run.force[asked, 0] - hold.stiffness * turned - hold.damping * faster
        assert run.force[:, 0] == pytest.approx(np.clip(between, 0.0, LIMIT), abs=1e-9)


class Motor(torch.nn.Module):
    """A servo without a past, in place of a network."""

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        """Return F = P (theta_d - theta) - D theta_dot [N] of the newest sample."""
        command, angle, speed = window[:, -1].unbind(dim=1)
        return HOLD.stiffness * (command - angle) - HOLD.damping * speed


def motor_run(recording: Recording, hold: HoldLaw, strength: float) -> Trajectory:
    """Replay with a motor that is asked 20 times a second, so many times as strong."""
    model = learned_model()
    values = {**model.actuator.values, "force_scale": strength}
    model = replace(model, actuator=replace(model.actuator, values=values))
    query = TorchScriptQuery(Motor(), window=1, rate=RATE, limit=LIMIT, hold=hold)
    rollout = Rollout(
        load_mechanism("finger"),
        [recording],
        model,
        force=NetworkSource(query),
        stepping=Stepping(time_step=5e-4),
        device="cpu",
    )
    return rollout.run(rollout.base_vectors(model)[None])[0][0]


@pytest.mark.parametrize("strength", [1.0, 0.7])
def test_a_motor_that_is_asked_now_and_then_moves_like_one_that_always_acts(strength, rng) -> None:
    """Where the law is the motor's own, queries change nothing, and no longer step does.

    To a fifteenth of an encoder's count. Held as it is, the same motor jerks a light finger about:
    its back-EMF comes 50 ms late. A weaker motor, which is scaled, is weaker between queries too.
    """
    recording = run_of(stairs(rng, 161, 0.8, 2.0, 20))
    viscous = NamedValues(name="viscous_friction", values={"coefficient": strength * HOLD.damping})
    values = {"gain": strength * HOLD.stiffness, "spool_radius": RADIUS}
    motor = Model(actuator=NamedValues(name="ideal", values=values), effects=(viscous,))
    (expected,) = simulate([recording], motor, time_step=1.25e-4)
    answering = motor_run(recording, HOLD, strength)
    assert answering.motor_position == pytest.approx(expected.motor_position, abs=1e-4)
    assert answering.force == pytest.approx(expected.force, abs=1e-3)
    held = motor_run(recording, PLAIN_HOLD, strength)
    assert np.abs(held.motor_position - expected.motor_position).max() > 0.5


def test_a_model_file_may_say_how_the_force_answers() -> None:
    """Its numbers stand before the card's: with zeros the force is held, as in the paper."""
    query = force_query(hold=HOLD)
    for model, damping in ((learned_model(), HOLD.damping), (learned_model(hold=PLAIN_HOLD), 0.0)):
        loop = ControlLoop(load_mechanism("finger"), model, 1, network=query, device="cpu")
        assert float(loop.numbers("learned", "hold_damping")) == damping


def test_a_run_begins_in_the_equilibrium_of_its_first_command(recordings: list[Recording]) -> None:
    """Until the second command nothing moves (float32 of the network against its slope)."""
    run = replay(recordings[:1])[0]
    assert np.ptp(run.motor_position[:20]) < 1e-5
    assert run.force[0, 0] > 1.0


def test_a_control_loop_is_a_replay(recordings: list[Recording]) -> None:
    """The same commands at the network's rate give the same motion (float32 of Newton)."""
    command = recordings[0].command[::STRIDE]
    expected = replay([run_of(command, rate=RATE)], **EFFECTS)[0]
    loop = ControlLoop(
        load_mechanism("finger"), learned_model(**EFFECTS), 1, network=force_query(), device="cpu"
    )
    tensors = torch.tensor(command, dtype=torch.float32)[:, None]
    loop.reset(tensors[0])
    angle = [float(loop.step(value).motor_position) for value in tensors[:-1]]
    assert angle == pytest.approx(expected.motor_position[1:, 0], abs=2e-5)


def test_an_uneven_log_asks_at_even_instants(rng: np.random.Generator) -> None:
    """Rows near an instant stand for it; where the log has none, one is put in."""
    time = np.sort(rng.uniform(0.0, 2.0, 60))
    recording = run_of(np.arange(60.0))
    object.__setattr__(recording, "time", time)
    timeline = with_queries(make_timeline(recording), RATE)
    (rows,) = query_table([timeline.time], RATE).T
    instants = time[0] + np.arange(len(rows)) / RATE
    assert np.abs(timeline.time[rows] - instants).max() < 0.1 / RATE
    assert np.all(np.diff(timeline.time) > 0.0)
    assert timeline.time[timeline.measured] == pytest.approx(time)
    source = np.searchsorted(timeline.measured, np.arange(len(timeline.time)), side="right") - 1
    smooth = np.isin(np.arange(len(timeline.time)), timeline.measured)
    assert timeline.command[smooth, 0] == pytest.approx(source[smooth])


def test_lost_rows_change_nothing_while_the_command_rests(recordings: list[Recording]) -> None:
    """A log with a gap inside a step of the command gives the same motion."""
    whole = recordings[0]
    kept = np.delete(np.arange(len(whole.time)), np.arange(43, 52))
    gappy = run_of(whole.command[kept])
    object.__setattr__(gappy, "time", whole.time[kept])
    expected, found = replay([whole])[0], replay([gappy])[0]
    assert found.motor_position == pytest.approx(expected.motor_position[kept], abs=1e-6)


def test_effects_on_the_error_change_what_the_network_is_shown() -> None:
    """A gain error of 0.5 halves the error that the network sees, and nothing else."""
    loop = ControlLoop(
        load_mechanism("finger"), learned_model(**EFFECTS), 1, network=force_query(), device="cpu"
    )
    loop.numbers("gain_error", "scale").fill_(0.5)
    posture = torch.tensor([[0.3, 0.2]])
    read = loop.reset(torch.tensor([[2.0]]), joint_position=posture)
    angle = float(read.motor_position)
    shown = loop.held.history.order().numpy()[0, -1]
    assert shown == pytest.approx([angle + 0.5 * (2.0 - angle), angle, 0.0], abs=1e-6)


@pytest.mark.parametrize(("bias", "force"), [(100.0, LIMIT), (-100.0, 0.0)])
def test_the_servo_gives_no_more_than_it_can_and_a_string_never_pushes(bias, force) -> None:
    """Whatever the network says, the force stays in [0, limit]."""
    query = force_query()
    query.module.force_mean.fill_(bias)
    loop = ControlLoop(
        load_mechanism("finger"), learned_model(**EFFECTS), 1, network=query, device="cpu"
    )
    loop.numbers("coulomb_friction", "force").fill_(0.0)
    loop.reset(torch.tensor([[2.0]]))
    assert float(loop.step(torch.tensor([[2.0]])).force) == pytest.approx(force, abs=1e-5)


def test_simulate_runs_a_learned_model(tmp_path, monkeypatch, recordings) -> None:
    """The network's file lies beside the model file, from wherever the program is called."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    (tmp_path / "data").mkdir()
    for index, recording in enumerate(recordings):
        write_csv(tmp_path / "data" / f"{index}.csv", recording)
    rows = [f'[[recordings]]\nfile = "{i}.csv"\nbench = "finger"\nsplit = "train"' for i in (0, 1)]
    (tmp_path / "data" / "dataset.toml").write_text("\n".join(rows))
    write_force_network(tmp_path / "force.pt", force_network())
    (tmp_path / "model.toml").write_text(
        '[actuator]\nkind = "learned"\nfile = "force.pt"\nspool_radius = 0.0125\n'
    )
    words = [
        "simulate",
        str(tmp_path / "data"),
        "--model",
        str(tmp_path / "model.toml"),
        "--out",
        str(tmp_path / "out"),
        "--no-plots",
        "--time-step",
        "5e-4",
    ]
    assert main(words) == 0
    assert (tmp_path / "out" / "1.csv").is_file()
    assert main([*words, "--network", "other"]) == 2


def test_a_model_without_its_file_is_refused(tmp_path, capsys, recordings) -> None:
    """In one line that says what is missing."""
    write_csv(tmp_path / "a.csv", recordings[0])
    (tmp_path / "dataset.toml").write_text(
        '[[recordings]]\nfile = "a.csv"\nbench = "finger"\nsplit = "train"\n'
    )
    (tmp_path / "model.toml").write_text('[actuator]\nkind = "learned"\n')
    words = [
        "simulate",
        str(tmp_path),
        "--model",
        str(tmp_path / "model.toml"),
        "--out",
        str(tmp_path / "out"),
    ]
    assert "'learned' needs file" in refusal(words, capsys)


def test_a_network_is_never_left_out_silently(recordings: list[Recording]) -> None:
    """A rollout that asks no network would hold no force at all."""
    with pytest.raises(InvalidParameter, match="needs the force of a network"):
        Rollout(load_mechanism("finger"), recordings, learned_model(), device="cpu")
    with pytest.raises(InvalidParameter, match="needs the force of a network"):
        DifferentiableRollout(load_mechanism("finger"), recordings, learned_model(), device="cpu")
