"""Many worlds under commands: masked resets, numbers by world, and worlds that diverge."""

from collections.abc import Callable
from dataclasses import fields

import newton
import numpy as np
import pytest
import torch
import warp as wp
from torch import Tensor

from tendon_newton.errors import InvalidParameter, SimulationDiverged
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.control_loop import ControlLoop, ControlReading
from tests.conftest import SEED
from tests.made import stated_model
from tests.physics.learned import networks
from tests.physics.learned.networks import force_query, learned_model
from tests.physics.runs import DELAYED, RADIUS, ROWS, ideal_model, run_of, simulate, stairs

WORLDS = 3
SERVO = {
    "duty_per_rad": 1.1, "max_duty": 0.9, "supply_voltage": 5.0, "torque_constant": 0.4,
    "resistance": 3.0, "armature": 0.002, "spool_radius": RADIUS,
}  # fmt: skip


def ideal_loop(worlds: int = WORLDS) -> ControlLoop:
    """Return fingers on ideal servos with friction and a delay."""
    return ControlLoop(load_mechanism("finger"), ideal_model(**DELAYED), worlds, device="cpu")


def servo_loop(worlds: int = WORLDS) -> ControlLoop:
    """Return fingers on servos with rotors."""
    model = stated_model("pwm_servo", SERVO)
    return ControlLoop(load_mechanism("finger"), model, worlds, precision="float32", device="cpu")


def learned_loop(worlds: int = WORLDS) -> ControlLoop:
    """Return fingers on learned servos with a lag, friction and a delay."""
    model = learned_model(hold=networks.HOLD, **networks.EFFECTS)
    return ControlLoop(load_mechanism("finger"), model, worlds, network=force_query(), device="cpu")


LOOPS = {"ideal": ideal_loop, "pwm_servo": servo_loop, "learned": learned_loop}


@pytest.fixture(params=LOOPS)
def make_loop(request: pytest.FixtureRequest) -> Callable[..., ControlLoop]:
    """Each actuator in turn."""
    return LOOPS[request.param]


def random_commands(count: int, worlds: int = WORLDS) -> Tensor:
    """Return commands [rad], shape (count, W, 1)."""
    generator = torch.Generator().manual_seed(SEED)
    return 1.0 + 4.0 * torch.rand(count, worlds, 1, generator=generator)


def kept(reading: ControlReading) -> dict[str, Tensor]:
    """Return a copy of a reading's tensors by name."""
    return {field.name: getattr(reading, field.name).clone() for field in fields(reading)}


def run(loop: ControlLoop, commands: Tensor) -> list[dict[str, Tensor]]:
    """Step through commands."""
    return [kept(loop.step(command)) for command in commands]


@pytest.mark.parametrize("put", [False, True])
def test_a_masked_reset_is_a_fresh_start(make_loop: Callable[..., ControlLoop], put: bool) -> None:
    """To the last bit, in the worlds that are reset; the others do not notice."""
    before, after = random_commands(9), random_commands(20)[9:]
    posture = {"joint_position": torch.full((WORLDS, 2), 0.3)} if put else {}
    used, fresh, undisturbed = make_loop(), make_loop(), make_loop()
    mask = torch.tensor([False, True, True])
    for loop in (used, undisturbed):
        loop.reset(before[0])
        run(loop, before)
    begun = [kept(used.reset(after[0], mask, **posture)), kept(fresh.reset(after[0], **posture))]
    began = [begun[0], *run(used, after)]
    expected = [begun[1], *run(fresh, after)]
    others = run(undisturbed, after)
    for step in range(len(expected)):
        for name, values in expected[step].items():
            assert torch.equal(began[step][name][mask], values[mask]), (step, name)
    for name, values in others[-1].items():
        assert torch.equal(began[-1][name][~mask], values[~mask]), name


def test_worlds_do_not_know_of_each_other(make_loop: Callable[..., ControlLoop]) -> None:
    """A batch is a loop over worlds; a network sums in another order (float32 rounding)."""
    commands = random_commands(8)
    together, alone = make_loop(), make_loop(1)
    together.reset(commands[0])
    alone.reset(commands[0, 2:])
    for batch, single in zip(run(together, commands), run(alone, commands[:, 2:]), strict=True):
        for name, values in single.items():
            torch.testing.assert_close(batch[name][2:], values, rtol=0.0, atol=2e-5)


def test_control_steps_are_rows_of_a_rollout(rng: np.random.Generator) -> None:
    """What a loop reads after a step is what a recording of its commands would hold."""
    command = stairs(rng, 61, 0.5, 3.0, 20)
    (expected,) = simulate([run_of(command)], ideal_model(**DELAYED), time_step=5e-4)
    loop = ControlLoop(load_mechanism("finger"), ideal_model(**DELAYED), 1, rate=ROWS, device="cpu")
    tensors = torch.tensor(command, dtype=torch.float32).reshape(-1, 1, 1)
    loop.reset(tensors[0])
    read = run(loop, tensors[:-1])
    angle = np.array([float(row["motor_position"]) for row in read])
    joints = np.array([row["joint_position"].numpy()[0] for row in read])
    assert joints == pytest.approx(expected.joint_position[1:], abs=1e-6)  # float32 of Newton
    assert angle == pytest.approx(expected.motor_position[1:, 0], abs=1e-5)


def test_the_tip_follows_the_joints() -> None:
    """The distal end of two links that lie in the plane y = 0."""
    loop = ideal_loop(1)
    read = loop.reset(torch.zeros(1, 1), joint_position=torch.tensor([[0.5, 0.4]]))
    x = 0.030 * np.cos(0.5) + 0.025 * np.cos(0.9)
    z = -0.030 * np.sin(0.5) - 0.025 * np.sin(0.9)
    assert read.tip[0].tolist() == pytest.approx([x, 0.0, z], abs=1e-6)


def test_the_tip_is_where_newton_has_it_to_the_bit() -> None:
    """Policies that learned from Newton's own kinematics go on to see the same tip."""
    loop = ideal_loop()
    read = loop.reset(random_commands(1)[0])
    mechanism = load_mechanism("finger")
    model = build_model(mechanism, WORLDS, device="cpu")
    state = model.state()
    state.joint_q.assign(read.joint_position.numpy().ravel())
    newton.eval_fk(model, state.joint_q, state.joint_qd, state)
    bodies = state.body_q.numpy().reshape(WORLDS, -1, 7)[:, mechanism.tip.body]
    point = wp.vec3(*mechanism.tip.point)
    places = [wp.transform_point(wp.transform(*body), point) for body in bodies]
    assert np.array(places, dtype=np.float32).tolist() == read.tip.tolist()
    assert np.ptp(read.joint_position.numpy()) > 0.1


def test_numbers_differ_by_world() -> None:
    """A gain, a delay, a spring and a spool each change their own world from the next step on."""
    loop = ControlLoop(load_mechanism("finger"), ideal_model(**DELAYED), 5, device="cpu")
    loop.numbers("ideal", "gain")[1] = 3.0
    loop.numbers("command_delay", "delay")[2] = 0.2
    loop.bench_numbers("stiffness")[3] *= 2.0
    loop.bench_numbers("spool_radius")[4] *= 0.9
    loop.reset(torch.full((5, 1), 0.5))
    for _ in range(3):
        read = kept(loop.step(torch.full((5, 1), 2.5)))
    closed = read["joint_position"].sum(dim=1)
    assert (closed[1:] - closed[0]).abs().min() > 0.01
    assert closed[2] < 0.5 * closed[0]  # the command has not arrived


def test_the_force_of_a_network_can_be_scaled_by_world() -> None:
    """So that a policy meets servos of several strengths: a weaker one closes a finger less."""
    loop = learned_loop(2)
    loop.held.scale[1] = 0.7
    assert loop.numbers("learned", "force_scale").tolist() == pytest.approx([1.0, 0.7])
    closed = kept(loop.reset(torch.full((2, 1), 2.0)))["joint_position"].sum(dim=1)
    assert 0.0 < closed[1] < closed[0] - 0.01
    begun = kept(loop.reset(torch.full((2, 1), 5.0), joint_position=torch.full((2, 2), 0.2)))
    stepped = kept(loop.step(torch.full((2, 1), 5.0)))
    first, second = loop.held.force.ravel().tolist()
    assert second == first > 1.0  # both were shown the same
    turned = stepped["motor_position"] - begun["motor_position"]
    assert turned[1] != turned[0]


def test_a_network_begins_in_its_own_equilibrium() -> None:
    """Where a run starts, the held force is what the network gives there: nothing moves."""
    loop = learned_loop()
    command = torch.tensor([[1.0], [2.0], [3.0]])
    begun = kept(loop.reset(command))
    later = run(loop, command.expand(10, -1, -1))[-1]
    assert begun["force"].min() > 0.1
    torch.testing.assert_close(
        later["motor_position"], begun["motor_position"], rtol=0.0, atol=1e-5
    )


@pytest.mark.parametrize("poison", ["command", "number"])
def test_a_world_that_diverges_harms_no_other(poison: str) -> None:
    """It is marked and named, stays finite, and is well again after a reset."""
    commands = random_commands(12)
    healthy, ill = learned_loop(), learned_loop()
    for loop in (healthy, ill):
        loop.reset(commands[0])
    ill_commands = commands.clone()
    if poison == "command":
        ill_commands[3, 1] = torch.nan
    else:
        ill.bench_numbers("mass")[1] = torch.nan
    expected, found = run(healthy, commands), run(ill, ill_commands)
    assert found[-1]["diverged"].tolist() == [False, True, False]
    for name in ("motor_position", "motor_velocity", "force", "joint_position", "tip"):
        assert torch.equal(found[-1][name][::2], expected[-1][name][::2]), name
        assert bool(torch.isfinite(found[-1][name]).all()), name
    with pytest.raises(SimulationDiverged, match="in world 1 of 3"):
        ill.require_finite()
    ill.bench_numbers("mass").copy_(healthy.bench_numbers("mass"))
    for loop in (healthy, ill):
        loop.reset(commands[0], torch.tensor([False, True, False]))
    ill.require_finite()
    assert torch.equal(run(ill, commands)[-1]["force"][1], run(healthy, commands)[-1]["force"][1])


def test_what_makes_no_sense_is_refused() -> None:
    """Shapes, masks, numbers and rates that do not fit."""
    loop = ideal_loop()
    command = torch.ones(WORLDS, 1)
    with pytest.raises(InvalidParameter, match="call reset"):
        loop.step(command)
    with pytest.raises(InvalidParameter, match=r"shape \(3, 1\); it has \(3,\)"):
        loop.reset(command[:, 0])
    with pytest.raises(InvalidParameter, match="must be a mask"):
        loop.reset(command, torch.tensor([1]))
    with pytest.raises(InvalidParameter, match="must be finite"):
        loop.reset(torch.full((WORLDS, 1), torch.nan))
    with pytest.raises(InvalidParameter, match="needs a joint_position"):
        loop.reset(command, joint_velocity=torch.zeros(WORLDS, 2))
    with pytest.raises(InvalidParameter, match="20 Hz needs a control rate"):
        ControlLoop(
            load_mechanism("finger"),
            learned_model(),
            1,
            rate=80.0,
            network=force_query(),
            device="cpu",
        )
    with pytest.raises(InvalidParameter, match="control rate must be"):
        ControlLoop(load_mechanism("finger"), ideal_model(), 1, rate=0.0, device="cpu")
