"""The load cell reads what the string carries: the slider's force to rounding, and its work.

Between spool and slider there is nothing but the string. So at every instant the cell's force is
m x'' + c x' + k x, whichever servo pulls and whichever host steps.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from tendon_newton.actuators.networks.torchscript import TorchScriptQuery
from tendon_newton.data.cards.force_network_card import PLAIN_HOLD, HoldLaw
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.hosts.replay import replay
from tests.made import stated_model
from tests.physics.learned.networks import LIMIT, RATE, force_network, write_force_network
from tests.physics.ledger import STIFFNESS, Books, jumps_of, one_step, random_steps
from tests.physics.runs import DATA_SHEET, ideal_model, run_of

ROWS = 4000.0  # Hz, so fine that a spline through the rows has the slider's acceleration
STEP = 1.25e-4  # s
QUERY_ROWS = round(ROWS / RATE)
CLOSE = 0.02  # N
SERVO = stated_model("pwm_servo", DATA_SHEET)
ANSWER = HoldLaw(stiffness=4.0, damping=0.5)
"""How a network's force answers to the shaft: the slider settles to it in a millisecond. No command
here asks for more than the servo gives. Where one does, each answer begins anew at the limit, and
the force jumps at every query."""
HOLDS = {"learned": ANSWER, "learned_plain": PLAIN_HOLD}


class Motor(torch.nn.Module):
    """A servo without a past, in place of a network."""

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        """Return F = P (theta_d - theta) - D theta_dot [N] of the newest sample."""
        command, angle, speed = window[:, -1].unbind(dim=1)
        return ANSWER.stiffness * (command - angle) - ANSWER.damping * speed


@pytest.fixture
def model_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Model]:
    """Each actuator's model; a network's file is written when asked for, and trusted."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))

    def model(actuator: str) -> Model:
        if actuator in HOLDS:
            file = tmp_path / "force.pt"
            write_force_network(file, force_network())
            law = HOLDS[actuator]
            values = {
                "file": str(file),
                "spool_radius": DATA_SHEET["spool_radius"],
                "hold_stiffness": law.stiffness,
                "hold_damping": law.damping,
            }
            return stated_model("learned", values)
        return {"ideal": ideal_model(), "pwm_servo": SERVO}[actuator]

    return model


def replayed(bench: str, command: Array, model: Model) -> Books:
    """Replay a command."""
    run = run_of(command, bench=bench, rate=ROWS)
    (out,) = replay([run], model, time_step=STEP)
    learned = model.actuator.name == "learned"
    return Books(
        bench=bench,
        time=run.time,
        slide=out.joint_position[:, 0],
        force=out.force[:, 0],
        jumps=jumps_of(command, QUERY_ROWS if learned else None),
    )


def looped(bench: str, command: Array, model: Model) -> Books:
    """Step through a command; a network is asked in every row."""
    query, jumps = None, jumps_of(command)
    if model.actuator.name == "learned":
        query = TorchScriptQuery(Motor(), window=1, rate=ROWS, limit=LIMIT)
        if model.actuator.values["hold_stiffness"] == 0.0:
            jumps = np.arange(len(command))  # a staircase: each answer is held for a row
    mechanism = load_mechanism(bench)
    loop = ControlLoop(mechanism, model, 1, rate=ROWS, max_step=STEP, network=query, device="cpu")
    commands = torch.tensor(command, dtype=torch.float32).reshape(-1, 1, 1)
    reading = loop.reset(commands[0])
    rows = np.zeros((len(command), 3))
    for k in range(len(command)):
        state = (reading.joint_position, reading.joint_velocity, reading.force)
        rows[k] = [float(values) for values in state]
        reading = loop.step(commands[k])
    return Books(
        bench=bench,
        time=np.arange(len(command)) / ROWS,
        slide=rows[:, 0],
        speed=rows[:, 1],
        force=rows[:, 2],
        jumps=jumps,
        read_before=True,
    )


ACTUATORS = ("ideal", "pwm_servo", *HOLDS)


def assert_balanced(books: Books) -> None:
    """The cell's force is the slider's in every row, and its work is stored or lost."""
    assert np.ptp(books.force) > 0.5
    imbalance = books.imbalance()
    assert len(imbalance) == len(books.time) - 1
    assert np.abs(imbalance).max() < CLOSE
    if books.speed is not None:
        assert books.blows().max() < CLOSE
    done, kept = books.work()
    assert done == pytest.approx(kept, rel=1e-4)


@pytest.mark.parametrize(
    "bench", ["spring_strong", pytest.param("spring_weak", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("actuator", ACTUATORS)
def test_after_a_step_the_cell_reads_what_moves_the_slider(actuator, bench, model_of) -> None:
    """Within 0.02 N in every row of a control loop, and 1e-4 of the work."""
    assert_balanced(looped(bench, one_step(ROWS), model_of(actuator)))


@pytest.mark.parametrize("bench", STIFFNESS)
@pytest.mark.parametrize("actuator", ACTUATORS)
def test_in_random_steps_the_cell_reads_what_moves_the_slider(actuator, bench, model_of) -> None:
    """Within as much over 12 s of a replay."""
    assert_balanced(replayed(bench, random_steps(ROWS), model_of(actuator)))


@pytest.mark.slow
@pytest.mark.parametrize("bench", STIFFNESS)
@pytest.mark.parametrize("actuator", ACTUATORS)
def test_a_control_loop_keeps_its_books_in_random_steps(actuator, bench, model_of) -> None:
    """The same over 12 s of a control loop."""
    assert_balanced(looped(bench, random_steps(ROWS), model_of(actuator)))
