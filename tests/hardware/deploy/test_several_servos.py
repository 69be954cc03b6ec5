"""A policy of two servos on the virtual finger between two strings."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_hardware.benches.bench import Bench, open_bench
from tendon_hardware.benches.bench_address import BenchAddress, DriveAddress
from tendon_hardware.control.goals import stairs
from tendon_hardware.control.policy_runner import Policy
from tendon_hardware.deployment.deploy_log import read_steps, step_table
from tendon_hardware.deployment.deploy_settings import DeploySettings, loops_of, refuse_mismatch
from tendon_hardware.errors import PolicyMismatch, ServoSilent
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench import FaultEvent, VirtualPorts
from tendon_newton.cli import main
from tendon_newton.data.cards.policy_card import FurtherServo
from tendon_newton.data.cards.policy_observation import ObservationHistory
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.mcap_file import read_session
from tendon_newton.errors import InvalidParameter
from tests.bad_input.damage import refusal
from tests.faults.cases import ALLOWED
from tests.hardware.deploy.policies import TwoSided, card_of, card_of_two, policy_of, write_onnx
from tests.hardware.deploy.runs import Flight

pytestmark = pytest.mark.usefixtures("nobody_at_the_keys")

WORDS = ["deploy", "--port", "virtual:finger_antagonist", "--faster-than-real-time"]
CARD = card_of_two()
SETTINGS = DeploySettings(duration=3.0, loop=loops_of(CARD)[0], further_loops=loops_of(CARD)[1:])
ADDRESS = BenchAddress(
    bench="finger_antagonist", port="virtual", further=(DriveAddress(identifier=2),)
)


def balancing(sample: np.ndarray) -> np.ndarray:
    """Close towards the goal with the first servo, and let out ahead of it with the second."""
    return np.array([1.6 * sample[8] - sample[0] + 0.3, -0.9 * sample[8] - sample[1] - 0.2])


def flight_of(**words: Any) -> Flight:
    """Prepare a deployment on the finger between two strings."""
    policy: Policy = policy_of(balancing, CARD)
    return Flight(**{"bench": "finger_antagonist", "policy": policy, "settings": SETTINGS} | words)


@pytest.fixture(scope="module")
def policy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy of two servos, as a file."""
    path = tmp_path_factory.mktemp("policy") / "two.onnx"
    return write_onnx(path, TwoSided(), CARD.to_json(), size=CARD.observation_size)


def test_two_servos_are_deployed_and_their_log_is_a_recording(policy, tmp_path, capsys) -> None:
    """Columns for both tendons, load cells included; the replay gives the same actions."""
    words = [*WORDS, "--policy", str(policy), "--out", str(tmp_path), "--goals", "stairs"]
    assert main([*words, "--duration", "6", "--split", "test"]) == 0
    log = tmp_path / "two_0.mcap"
    (recording,) = load_dataset(tmp_path, require_train=False).test
    assert recording.bench == "finger_antagonist"
    assert recording.command is not None
    assert recording.force is not None
    for signal in (recording.motor_position, recording.command, recording.force):
        assert signal.shape == (recording.sample_count, 2)
    closed, opened = np.ptp(recording.motor_position, axis=0)
    assert min(closed, opened) > 0.3
    assert recording.motor_position[:, 1].min() < -0.3  # the extensor is let out
    assert recording.tip is not None
    session = read_session(log)
    assert session["servo_1.identifier"] == "2"
    assert session["policy.step_fields"].startswith("theta_0, theta_1, theta_dot_0")
    assert int(session["counters.load_cell_1.lines"]) > 100
    capsys.readouterr()
    assert main(["deploy", "--policy", str(policy), "--replay", str(log)]) == 0
    assert "outputs differ by 0.00e+00 rad" in capsys.readouterr().out
    assert main(["plot", str(log)]) == 0
    assert "spool angle of servo 1 [rad]" in log.with_suffix(".svg").read_text(encoding="utf-8")


def test_the_log_holds_what_a_policy_of_two_servos_saw_bit_for_bit(tmp_path: Path) -> None:
    """Each sample is that of the one definition of the observation, with the actions applied."""
    path = tmp_path / "run.mcap"
    flight_of(path=path, goals=stairs(0.3)).fly()
    history = ObservationHistory(servos=2)
    for step in read_steps(path):
        observation = history.observe(step.sample[:2], step.sample[2:4], [step.sample[8]])
        assert tuple(observation[0, -9:].tolist()) == step.sample
        assert step.output == tuple(balancing(observation[0, -9:]).tolist())
        history.act(step.action)
    assert step_table(path).shape[1] == 6


def test_commands_of_each_servo_stay_within_its_own_range(tmp_path: Path) -> None:
    """A policy that pulls with all its might is stopped by the card's ranges, servo by servo."""
    path = tmp_path / "run.mcap"
    further = replace(CARD.further_servos[0], command_range=(-1.8, 0.4))
    card = replace(CARD, command_range=(0.0, 1.0), further_servos=(further,))
    settings = replace(SETTINGS, loop=loops_of(card)[0], further_loops=loops_of(card)[1:])
    strong = policy_of(lambda sample: np.full(2, 19.0), card)
    flight_of(path=path, policy=strong, settings=settings).fly()
    assert {step.action for step in read_steps(path)} == {(2.0, 2.0)}, "cut by the card's clip"
    commands = step_table(path)[:, 4:]
    assert commands.max(axis=0).tolist() == [1.0, 0.4]


def line_of(bench: Bench) -> Any:
    """Return what the second servo is made of."""
    return bench.controls.plant.lines[1]  # pyright: ignore


def slip(bench: Bench, stop: StopRequest) -> None:
    """Let the second spool spin out of its window."""
    line_of(bench).motor.angle = -4.0


def heat(bench: Bench, stop: StopRequest) -> None:
    """Heat the second motor."""
    line_of(bench).motor.temperature = 68.0


def load(bench: Bench, stop: StopRequest) -> None:
    """Hang four kilogrammes on the second load cell."""
    line_of(bench).load_cell.mass = 4.0


def let(name: str, **words: Any) -> Any:
    """Let an event happen to the second servo."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        event = FaultEvent(name=name, start=bench.clock.now(), servo=1, **words)
        bench.controls.plan(event)  # pyright: ignore

    return happen


@pytest.mark.parametrize(
    ("fault", "rule", "action"),
    [
        (slip, "position_window", "off"),
        (let("alert", alert="overload"), "servo_stopped", "off"),
        (let("reboot"), "missed_reads", "hold"),
        (load, "tension", "unwind"),
        (heat, "temperature", "unwind"),
        (let("cell_silence", duration=0.4), "stale_force", "hold"),
    ],
)
def test_what_one_servo_breaks_acts_on_both(fault: Any, rule: str, action: str) -> None:
    """Within the time of the table, by the name of the servo, and both motors end off."""
    flight = flight_of(fault=fault, after=0.7)
    outcome = flight.fly()
    (first, *_) = [trip for trip, _ in flight.acted if trip.rule.name == rule]
    assert (first.action, first.servo) == (action, 1)
    assert first.reason.startswith("servo 2: ")
    assert flight.latency(rule) <= ALLOWED
    assert not flight.torque_after
    if action == "hold":
        held = [shown.command for shown in flight.operator.shown if shown.mode == "hold"]  # pyright: ignore
        assert held
        assert len(set(held)) == 1
    else:
        assert str(outcome.fault) == first.reason


def test_a_stop_lets_both_strings_out(tmp_path: Path) -> None:
    """Each spool comes to the lower end of its own range before its motor is off."""
    path = tmp_path / "run.mcap"
    flight = flight_of(path=path)
    assert flight.fly().fault is None
    log = read_recording_file(path, bench="finger_antagonist")
    assert log.motor_position[-1] == pytest.approx([0.0, -1.8], abs=0.1)
    assert not flight.torque_after


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"servo": "xl330_m288_t"}, "servo of servo 1 xl330_m288_t, this bench xc330_t288_t"),
        ({"spool_radius": 0.02}, "spool_radius_m of servo 1 0.02, this bench 0.0125"),
        ({"force_limit": 40.0}, "force_limit_n of servo 1 40, this bench 30 at most"),
        ({"command_range": (-1.8, 9.0)}, "command_range_rad of servo 1 -1.800 to 9.000"),
    ],
)
def test_a_further_servo_that_differs_is_refused(changes: dict[str, Any], said: str) -> None:
    """What the card says of each servo must agree; the message names which."""
    further = FurtherServo(
        **{
            "command_range": (-1.8, 4.4),
            "spool_radius": 0.0125,
            "servo": "xc330_t288_t",
            "force_limit": 21.0,
        }
        | changes
    )
    with pytest.raises(PolicyMismatch, match=said):
        refuse_mismatch(card_of_two(further_servos=(further,)), SETTINGS, ADDRESS)


def test_a_bench_needs_as_many_servos_as_the_policy_drives() -> None:
    """One too many or one too few, on a virtual bench, which knows how many it has."""
    refuse_mismatch(CARD, SETTINGS, ADDRESS)
    with pytest.raises(PolicyMismatch, match="servos 2, this bench 1"):
        refuse_mismatch(CARD, SETTINGS, replace(ADDRESS, bench="finger"))
    alone = replace(ADDRESS, further=())
    with pytest.raises(PolicyMismatch, match="servos 1, this bench 2"):
        refuse_mismatch(card_of(), replace(SETTINGS, further_loops=()), alone)
    with pytest.raises(InvalidParameter, match="own ID; they are 2, 2"):
        BenchAddress(
            bench="finger_antagonist", port="virtual", identifier=2, further=ADDRESS.further
        )


def test_a_hand_moves_one_of_two_servos(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Jogging drives the servo that is named; an ID that no servo has is refused."""
    words = [*WORDS, "--jog", "--duration", "1", "--out", str(tmp_path)]
    assert main([*words, "--servo-id", "2"]) == 0
    log = read_recording_file(tmp_path / "jog_0.mcap", bench="finger_antagonist")
    assert log.tendon_count == 1
    assert np.ptp(log.motor_position) < 0.05  # it holds where it is
    capsys.readouterr()
    assert "have the IDs 1 to 2; 3 was asked for" in refusal([*words, "--servo-id", "3"], capsys)
    assert "--jog moves one servo" in refusal([*words, "--further-servo-ids", "2"], capsys)


def test_a_dry_run_leaves_both_motors_off(policy, tmp_path, monkeypatch) -> None:
    """The policy sees and decides; neither motor is switched on, and nothing is sent."""
    monkeypatch.setattr(BusServo, "enable_torque", lambda servo: pytest.fail("it is switched on"))
    words = [*WORDS, "--policy", str(policy), "--out", str(tmp_path), "--dry-run"]
    assert main([*words, "--goals", "1.0", "--duration", "2"]) == 0
    log = read_recording_file(tmp_path / "two_0.mcap", bench="finger_antagonist")
    assert log.command is None
    assert np.ptp(log.motor_position, axis=0).max() < 0.05
    decided = [step.action for step in read_steps(tmp_path / "two_0.mcap")]
    assert len(decided) == 40
    assert np.abs(decided).max() > 0.5


def test_servos_and_load_cells_are_reached_through_real_ports() -> None:
    """Two drivers share a port; each has its own servo, and each tendon its own cell."""
    with VirtualPorts("finger_antagonist") as ports:
        first, second = ports.load_cell_ports
        address = BenchAddress(
            bench="finger_antagonist",
            port=ports.servo_port,
            load_cell_port=first,
            retries=20,
            further=(DriveAddress(identifier=2, load_cell_port=second),),
        )
        with open_bench(address, pytest.fail) as bench:
            states = [drive.servo.read_state() for drive in bench.drives]
            assert states[0].time < states[1].time
            bench.clock.sleep_until(bench.clock.now() + 0.5)
            readings = [drive.load_cell.drain() for drive in bench.drives if drive.load_cell]
        assert [len(each) > 3 for each in readings] == [True, True]
        assert readings[0][-1].counts != readings[1][-1].counts


def test_a_servo_that_is_missing_from_the_bus_is_named() -> None:
    """The error says which, and the port is free again."""
    with VirtualPorts("finger") as ports:
        address = BenchAddress(
            bench="finger", port=ports.servo_port, retries=3, further=(DriveAddress(identifier=2),)
        )
        with pytest.raises(ServoSilent, match="servo 2 on"), open_bench(address, pytest.fail):
            pass
        with open_bench(replace(address, further=(), retries=20), pytest.fail) as bench:
            assert bench.servo.read_state().position == pytest.approx(0.0, abs=7.0)
