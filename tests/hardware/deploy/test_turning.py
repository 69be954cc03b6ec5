"""A policy that turns a ball, on the virtual hand."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_hardware.benches.bench import Bench, open_bench
from tendon_hardware.benches.bench_address import BenchAddress, DriveAddress
from tendon_hardware.control.goals import FixedGoal
from tendon_hardware.control.keyboard import Keyboard
from tendon_hardware.control.pilot import BallPilot
from tendon_hardware.control.policy_runner import Policy, load_policy
from tendon_hardware.deployment.ball_watch import BallWatch
from tendon_hardware.deployment.deploy import Deployment, DeployOutcome, deploy
from tendon_hardware.deployment.deploy_log import read_steps
from tendon_hardware.deployment.deploy_plot import shown_lines
from tendon_hardware.deployment.deploy_settings import DeploySettings, loops_of, refuse_mismatch
from tendon_hardware.deployment.turning_report import log_figures, read_truth
from tendon_hardware.errors import BallNotSeen, PolicyMismatch
from tendon_hardware.safety_rules.rule_limits import OUTPUT_SHARE, DeployLimits
from tendon_hardware.servos.base import ServoState
from tendon_hardware.stop_request import StopRequest
from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.formats.mcap_file import messages_of, read_session
from tendon_newton.data.formats.topic_mapping import BALL_TOPIC
from tests.hardware.deploy.policies import FINGERS, TASK, write_gait
from tests.hardware.deploy.runs import at_instant, calibration_files
from tests.hardware.silent_operator import SilentOperator

pytestmark = pytest.mark.usefixtures("nobody_at_the_keys")

LIMIT = 21.0  # The most that a servo can pull, as the card says [N]


@pytest.fixture(scope="module")
def gait(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy's file."""
    return write_gait(tmp_path_factory.mktemp("gait") / "gait.onnx")


@pytest.fixture(scope="module")
def policy(gait: Path) -> Policy:
    """The same, loaded."""
    return load_policy(gait)


def address_of(**changes: Any) -> BenchAddress:
    """Return where the virtual hand is, its cells calibrated."""
    first, *others = calibration_files("hand_ball", 80)
    further = [DriveAddress(identifier=2 + k, calibration=each) for k, each in enumerate(others)]
    values = {
        "bench": "hand_ball", "port": "virtual", "load_cell_rate": 80, "lockstep": True,
        "calibration": first, "further": tuple(further),
    }  # fmt: skip
    return BenchAddress(**values | changes)


def turn(
    policy: Policy, path: Path, duration: float, then: Callable[[Bench], None] = lambda bench: None
) -> tuple[DeployOutcome, SilentOperator, BallWatch]:
    """Deploy a policy; a fault may be planned when the bench is open."""
    operator = SilentOperator()
    loop, *further = loops_of(policy.card)
    limits = DeployLimits(output=OUTPUT_SHARE * policy.card.action_clip)
    settings = DeploySettings(
        duration=duration, loop=loop, further_loops=tuple(further), limits=limits
    )
    with open_bench(address_of(), operator.tell) as bench, StopRequest() as stop:
        watch = BallWatch(bench, TASK, operator)
        watch.open()
        then(bench)
        deployment = Deployment(
            bench=bench,
            pilot=BallPilot(policy, watch),
            settings=settings,
            goals=FixedGoal(1.0, policy.card.goal_range),
            policy=policy,
            watch=watch,
        )
        with Keyboard(-1) as keyboard:
            outcome = deploy(deployment, path, keyboard, operator, stop)
        watch.close()
    return outcome, operator, watch


@dataclass(frozen=True)
class Turned:
    """A run of 3 s, and what became of it."""

    path: Path
    outcome: DeployOutcome
    watch: BallWatch


@pytest.fixture(scope="module")
def turned(policy: Policy, tmp_path_factory: pytest.TempPathFactory) -> Turned:
    """One run for all tests that only read it."""
    path = tmp_path_factory.mktemp("turned") / "run.mcap"
    outcome, _, watch = turn(policy, path, 3.0)
    return Turned(path, outcome, watch)


def sightings(path: Path) -> list[tuple[float, tuple[float, ...]]]:
    """Return when each place of the ball arrived [s], and the place [m]."""
    return [
        (1e-9 * stamp, (message.point.x, message.point.y, message.point.z))
        for _, stamp, message in messages_of(path, BALL_TOPIC)
    ]


def test_a_ball_is_turned_from_the_command_line(gait, tmp_path, capsys) -> None:
    """The summary, the log as a recording of four tendons, the replay and the plot."""
    words = ["deploy", "--policy", str(gait), "--port", "virtual:hand_ball:3", "--goals", "1.0"]
    words += ["--duration", "4", "--faster-than-real-time", "--out", str(tmp_path)]
    assert main([*words, "--split", "test"]) == 0
    said = capsys.readouterr()
    assert "rad/min" in said.out + said.err
    assert "goal 1.00 rad/s" in said.out + said.err
    log = tmp_path / "gait_0.mcap"
    (recording,) = load_dataset(tmp_path, require_train=False).test
    assert recording.motor_position.shape[1] == FINGERS
    assert recording.force is not None
    assert np.nanmax(recording.force) > 2.0
    session = read_session(log)
    assert session["ball.drops"] == "0"
    assert "rate, behind, ball_x, ball_y, ball_z" in session["policy.step_fields"]
    assert main(["deploy", "--policy", str(gait), "--replay", str(log)]) == 0
    assert "outputs differ by 0.00e+00 rad" in capsys.readouterr().out
    assert main(["plot", str(log)]) == 0
    drawn = log.with_suffix(".svg").read_text(encoding="utf-8")
    assert "ball from its start" in drawn
    assert "ball behind what was asked" in drawn
    assert "rad, asked for" in drawn
    assert "goal angle" not in drawn


def test_a_policy_sees_the_latest_place_that_the_camera_told(turned: Turned) -> None:
    """Each sample's coordinates are those of the last line before it, and the rate is the goal."""
    assert turned.outcome.fault is None
    assert turned.watch.drops == 0
    told = sightings(turned.path)
    assert len(told) > 80
    for step in list(read_steps(turned.path))[5:]:
        latest = [place for arrived, place in told if arrived <= step.time - 0.005][-1:]
        # a line may come while servos are read, 8 ms of a tick
        newest = [place for arrived, place in told if arrived <= step.time][-1]
        assert step.goal == 1.0
        assert step.seen[1:] in [tuple(np.float32(p).tolist()) for p in (*latest, newest)]


@dataclass
class ScriptedEye:
    """What a camera tells of a ball that a test turns."""

    turned: float = 3.0
    lost: bool = False
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)


def test_a_policy_knows_how_far_its_ball_is_behind(policy: Policy) -> None:
    """Asked for 0.05 rad a step it turns 0.02: 1 rad at most, and nothing once it is put back."""
    eye = ScriptedEye()
    pilot = BallPilot(policy, eye)
    still = [ServoState(time=0.0, position=0.0, velocity=0.0, current=0.0)] * FINGERS
    behind = []
    for _ in range(50):
        eye.turned += 0.02
        step = pilot.step(still, 1.0)
        behind.append(step.sample[-4])
        pilot.apply(step)
    assert behind == pytest.approx(np.minimum(0.03 * np.arange(1, 51), 1.0), abs=1e-5)  # float32
    eye.lost = True
    pilot.step(still, 1.0)
    eye.lost, eye.turned = False, 9.0
    assert pilot.step(still, 1.0).sample[-4] == pytest.approx(0.05)


def test_the_camera_follows_the_turn_of_the_ball(tmp_path: Path) -> None:
    """Over 3 s, within three deviations of two frames' noise and a frame's delay; a plot has it."""
    path = tmp_path / "run.mcap"
    _, _, watch = turn(load_policy(Path("assets/policies/hand-turning.onnx")), path, 3.0)
    (true,) = log_figures(path, TASK).turned
    assert watch.turned == pytest.approx(true, abs=0.3)
    asked, seen = shown_lines(path)["turn of the ball [rad]"]
    assert asked.values[-1] == pytest.approx(3.0, abs=0.1)  # a step or two of 20 Hz
    assert seen.values[-1] == watch.turned
    assert true > 1.0


def test_the_true_pose_stands_in_the_log(turned: Turned) -> None:
    """Quaternions of length 1, twelve joints that move, and places within the camera's noise."""
    path = turned.path
    _, pose, joints = read_truth(path)
    assert np.linalg.norm(pose[:, 3:], axis=1) == pytest.approx(1.0, abs=1e-9)
    assert joints.shape[1] == 12
    assert np.ptp(joints, axis=0).max() > 0.3
    seen = np.array([place for _, place in sightings(path)])
    assert seen.mean(axis=0) == pytest.approx(np.mean(pose[:, :3] - pose[0, :3], axis=0), abs=2e-3)
    figures = log_figures(path, TASK)
    assert figures.seconds == pytest.approx(3.0, rel=0.1)
    assert 2.0 < figures.largest_tension < LIMIT
    assert figures.drops_per_minute == 0.0


def test_a_ball_that_is_lost_is_put_back_between_open_fingers(policy, tmp_path) -> None:
    """The fingers open, a hand puts the virtual ball back, and the policy goes on."""
    path = tmp_path / "run.mcap"

    def knock(bench: Bench) -> None:
        scene = bench.controls.plant.mechanism  # pyright: ignore
        at_instant(bench, bench.clock.now() + 2.0, lambda: scene.throw((0.0, 0.0, -2.0)))

    outcome, operator, watch = turn(policy, path, 9.0, knock)
    assert outcome.fault is None
    assert (watch.drops, watch.lost) == (1, False)
    assert log_figures(path, TASK).drops.tolist() == [1]
    said = " ".join(operator.told)
    assert "put it back" in said
    assert "the policy goes on" in said
    steps = list(read_steps(path))
    waiting = [step for step in steps if step.output == (0.0,) * FINGERS]
    assert 40 <= len(waiting) <= 100  # 2 to 5 s of 20 Hz
    assert max(waiting[-1].sample[:FINGERS]) < 0.6  # rad, open
    assert max(max(step.sample[:FINGERS]) for step in steps[-20:]) > 0.6  # closes again


def test_a_policy_for_another_hand_is_refused(policy: Policy) -> None:
    """The card names the asset with its ball."""
    loop, *further = loops_of(policy.card)
    settings = DeploySettings(loop=loop, further_loops=tuple(further))
    refuse_mismatch(policy.card, settings, address_of())
    with pytest.raises(PolicyMismatch, match=r"turning\.asset hand_ball, this bench hand"):
        refuse_mismatch(policy.card, settings, address_of(bench="hand"))


def test_a_bench_without_a_camera_is_refused() -> None:
    """In one line, which says how a camera is named."""
    with open_bench(address_of(), pytest.fail) as bench:
        bench.camera = None
        with pytest.raises(BallNotSeen, match="--camera-port"):
            BallWatch(bench, TASK, SilentOperator())


def test_a_ball_that_nobody_sees_is_refused_before_any_motor_runs() -> None:
    """The camera must see it in its cup."""
    with open_bench(address_of(), pytest.fail) as bench:
        bench.controls.plant.mechanism.throw((0.0, 0.0, -50.0))  # pyright: ignore
        bench.clock.sleep_until(bench.clock.now() + 0.2)
        with pytest.raises(BallNotSeen, match="saw the ball 0 times"):
            BallWatch(bench, TASK, SilentOperator()).open()


@pytest.mark.parametrize("asked", [0.5, pytest.param(1.0, marks=pytest.mark.slow)])
def test_the_policy_that_comes_along_heeds_its_rate_on_a_hand_that_it_never_met(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], asked: float
) -> None:
    """Unit 10, asked for 30 and 60 rad/min for 12 s: within a fifth, and the ball stays."""
    words = ["deploy", "--policy", "hand-turning", "--port", "virtual:hand_ball:10"]
    words += ["--goals", str(asked), "--duration", "12", "--faster-than-real-time"]
    assert main([*words, "--out", str(tmp_path)]) == 0
    capsys.readouterr()
    figures = log_figures(tmp_path / "hand-turning_0.mcap", TASK)
    assert figures.turned_per_minute == pytest.approx(60.0 * asked, rel=0.2)
    assert figures.drops.sum() == 0
    assert figures.largest_tension < LIMIT
