"""Physics of the virtual bench against hand calculation."""

import hashlib
import math
import random
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tendon_hardware.virtual_bench.emulation.plant import Plant
from tendon_hardware.virtual_bench.physics.constants import (
    BENCH_SEEDS,
    FingerConstants,
    ServoConstants,
    SliderConstants,
    TendonConstants,
)
from tendon_hardware.virtual_bench.physics.mechanisms import Finger, Slider
from tendon_hardware.virtual_bench.physics.motor import Motor
from tendon_hardware.virtual_bench.physics.obstacle import BenchObstacle, grips
from tendon_hardware.virtual_bench.physics.tendon import BenchTendon
from tendon_hardware.virtual_bench.physics.unit import SERVOS, draw_unit
from tendon_newton.errors import UnknownName
from tests.hardware.virtual_bench.link import nominal_unit

STEP = 0.25e-3  # [s]
COLD = ServoConstants(ambient=25.0, supply_resistance=0.0)


def driven(constants: ServoConstants, duty: float, duration: float, tension: float = 0.0) -> Motor:
    """Return a motor that was driven for a while from rest."""
    motor = Motor(constants)
    motor.enabled, motor.duty = True, duty
    for _ in range(round(duration / STEP)):
        motor.advance(tension, STEP)
    return motor


def test_what_is_no_name_of_a_bench_is_refused_with_the_names() -> None:
    """A number in place of a bench gets the error of an unknown name."""
    with pytest.raises(UnknownName, match="finger"):
        draw_unit(3, 0)


def test_stall_current_is_voltage_over_resistance() -> None:
    """Held by a tension that it cannot pull, the motor takes u V / R."""
    motor = driven(COLD, 0.5, 0.2, tension=45.0)
    assert motor.rate == 0.0
    assert motor.current == pytest.approx(0.5 * COLD.supply_voltage / COLD.resistance)
    assert motor.input_current == pytest.approx(0.5 * motor.current)


def test_the_no_load_speed_is_the_data_sheets() -> None:
    """Full duty without load: 52 rpm within the tenth that the friction's sources disagree by."""
    motor = driven(COLD, 1.0, 2.0)
    assert motor.rate * 60.0 / (2.0 * math.pi) == pytest.approx(52.0, rel=0.10)


def test_the_tension_that_just_moves_is_the_hand_calculation() -> None:
    """Pulling in stops at (kt i (1 - c_m) - tau_c) / (r (1 + c_e)); 0.5 % either side decides."""
    c = COLD
    torque = c.torque_constant * 0.4 * c.supply_voltage / c.resistance
    stick = c.dry_friction * (1.0 + c.stick_excess)
    edge = (torque * (1.0 - c.motor_load_friction) - stick) / (
        c.spool_radius * (1.0 + c.tendon_load_friction)
    )
    assert driven(c, 0.4, 0.05, tension=1.005 * edge).rate == 0.0
    assert driven(c, 0.4, 0.05, tension=0.995 * edge).rate > 0.0


def test_the_gear_holds_a_load_without_duty_up_to_a_bound() -> None:
    """With no duty it holds what r F (1 - c_e) <= tau_stick allows, exactly still, and no more."""
    c = replace(COLD, viscous_friction=0.0)
    bound = (
        c.dry_friction * (1.0 + c.stick_excess) / (c.spool_radius * (1.0 - c.tendon_load_friction))
    )
    assert driven(c, 0.0, 1.0, tension=0.999 * bound).angle == 0.0
    assert driven(c, 0.0, 1.0, tension=1.001 * bound).angle < 0.0


def test_a_motor_that_is_off_brakes_with_friction_alone() -> None:
    """Torque off opens the bridge: no current flows, and the shaft comes to rest."""
    motor = driven(COLD, 1.0, 0.5)
    motor.enabled = False
    for _ in range(4000):
        motor.advance(0.0, STEP)
    assert motor.current == 0.0
    assert motor.rate == 0.0


def test_gear_friction_never_adds_power() -> None:
    """For any duty and tension the shaft gains no more energy than motor and tendon give."""
    rng = random.Random(2)
    c = COLD
    for _ in range(300):
        motor = Motor(c)
        motor.enabled, motor.duty = True, rng.uniform(-1.0, 1.0)
        motor.rate = rng.uniform(-8.0, 8.0)
        tension = rng.uniform(0.0, 30.0)
        before = motor.rate
        motor.advance(tension, STEP)
        torque = c.torque_constant * motor.current - c.spool_radius * tension
        given = torque * motor.rate * STEP
        gained = 0.5 * c.inertia * (motor.rate**2 - before**2)
        assert gained <= given + 1e-12


def test_the_capstan_keeps_its_ratio_and_holds_between() -> None:
    """Winding in slips at F = T e^phi, paying out at F = T e^-phi; between, the guide holds."""
    c = TendonConstants(slack=0.0)
    ratio = math.exp(c.guide_friction + c.routing_friction)
    tendon = BenchTendon(c)
    for k in range(200):
        tendon.settle(1e-5 * k, 0.0)
    assert tendon.spool_side / tendon.mechanism_side == pytest.approx(ratio)
    held = tendon.passed
    tendon.settle(1e-5 * 199 - 1e-6, 0.0)
    assert tendon.passed == held
    for k in range(150):
        tendon.settle(1e-5 * (199 - k), 0.0)
    assert tendon.spool_side / tendon.mechanism_side == pytest.approx(1.0 / ratio)


def test_a_slack_line_pulls_nothing_and_a_taut_one_is_two_springs() -> None:
    """Up to the slack there is no tension; beyond, without a guide, that of springs in series."""
    c = TendonConstants(slack=1e-3, guide_friction=0.0, routing_friction=0.0)
    tendon = BenchTendon(c)
    tendon.settle(0.9e-3, 0.0)
    assert tendon.spool_side == 0.0
    tendon.settle(2e-3, 0.0)
    series = 1.0 / (1.0 / c.spool_side_stiffness + 1.0 / c.mechanism_side_stiffness)
    assert tendon.spool_side == pytest.approx(1e-3 * series)


def test_a_slider_rests_where_the_spring_holds_the_tension() -> None:
    """It stands at T / k without rail friction; with it, within f / k of that."""
    for friction in (0.0, 0.3):
        c = SliderConstants(stiffness=800.0, rail_friction=friction)
        slider = Slider(c)
        for _ in range(8000):
            slider.advance(10.0, 0.0, STEP)
        assert slider.excursion == pytest.approx(10.0 / 800.0, abs=friction / 800.0 + 1e-9)


def test_a_finger_rests_where_springs_and_weight_balance() -> None:
    """Each joint's torques sum to zero: j T + weight = k q, as written by hand."""
    c = FingerConstants()
    finger = Finger(c)
    for _ in range(60_000):  # 15 s: the Maxwell branches relax
        finger.advance(3.0, 0.0, STEP)
    (q1, q2), (l1, l2), (m1, m2) = finger.angles, c.lengths, c.masses
    weight2 = m2 * c.gravity * 0.5 * l2 * math.cos(q1 + q2)
    weight1 = (0.5 * m1 + m2) * c.gravity * l1 * math.cos(q1) + weight2
    assert c.stiffness[0] * q1 == pytest.approx(c.moment_arms[0] * 3.0 + weight1, rel=1e-4)
    assert c.stiffness[1] * q2 == pytest.approx(c.moment_arms[1] * 3.0 + weight2, rel=1e-4)
    assert finger.excursion == pytest.approx(c.moment_arms[0] * q1 + c.moment_arms[1] * q2)


def test_a_finger_never_gains_energy() -> None:
    """Released from above its rest, its energy only falls: springs, motion and height."""
    c = FingerConstants()
    finger = Finger(c)
    finger.angles = (0.2, 0.15)  # it swings without meeting a stop
    last = math.inf
    for _ in range(4000):
        finger.advance(0.0, 0.0, STEP)
        now = energy(c, finger)
        assert now <= last + 1e-12  # [J]
        last = now
    assert min(finger.angles) > 0.0


def test_a_stop_gives_back_less_than_it_took() -> None:
    """Thrown open, the finger leaves the stop slower than it came, and rests inside its range."""
    c = FingerConstants()
    finger = Finger(c)
    finger.angles, finger.rates = (0.3, 0.2), (-8.0, -8.0)
    rates = []
    for _ in range(8000):
        finger.advance(0.0, 0.0, STEP)
        rates.append(finger.excursion_rate)
    assert max(rates) < 0.5 * -min(rates)
    assert all(0.0 < q < limit for q, limit in zip(finger.angles, c.limits, strict=True))


def energy(c: FingerConstants, finger: Finger) -> float:
    """Return the mechanical energy [J]."""
    (q1, q2), (v1, v2) = finger.angles, finger.rates
    (l1, l2), (m1, m2), (k1, k2) = c.lengths, c.masses, c.stiffness
    cross = 0.5 * m2 * l1 * l2 * math.cos(q2)
    a22 = m2 * l2 * l2 / 3.0
    a11 = m1 * l1 * l1 / 3.0 + m2 * l1 * l1 + a22 + 2.0 * cross
    motion = 0.5 * (a11 * v1 * v1 + a22 * v2 * v2) + (a22 + cross) * v1 * v2
    springs = 0.5 * (k1 * q1 * q1 + k2 * q2 * q2)
    branches = sum(
        x * x / (2.0 * c.maxwell_ratio * k)
        for x, k in zip(finger.branches, c.stiffness, strict=True)
    )
    pads = sum(
        0.5 * c.pad_stiffness * max(0.0, q - limit + c.pad_reach) ** 2
        for q, limit in zip(finger.angles, c.limits, strict=True)
    )
    height = -0.5 * m1 * l1 * math.sin(q1) - m2 * (l1 * math.sin(q1) + 0.5 * l2 * math.sin(q1 + q2))
    return motion + springs + branches + pads + c.gravity * height


def test_a_maxwell_branch_relaxes_in_its_time() -> None:
    """Held still, here by enormous damping, a branch falls to 1/e in its relaxation time."""
    c = FingerConstants(damping=(1e6, 1e6))
    finger = Finger(c)
    finger.branches = (1e-3, 2e-3)
    for _ in range(round(c.maxwell_time / STEP)):
        finger.advance(0.0, 0.0, STEP)
    # backward Euler: off by half a step of 1.4 s
    assert finger.branches == pytest.approx((1e-3 / math.e, 2e-3 / math.e), rel=2e-4)


def test_the_guide_never_adds_power() -> None:
    """Whatever both ends do, what the spool puts in covers what comes out and what is kept."""
    c = TendonConstants(slack=0.0)
    tendon, rng = BenchTendon(c), random.Random(4)
    ka, kb = c.spool_side_stiffness, c.mechanism_side_stiffness
    wound = excursion = work = kept = 0.0
    for _ in range(20_000):
        step, give = rng.uniform(-2e-6, 2.1e-6), rng.uniform(-2e-6, 2e-6)
        before = tendon.spool_side, tendon.mechanism_side
        wound, excursion = wound + step, excursion + give
        tendon.settle(wound, excursion)
        work += 0.5 * (before[0] + tendon.spool_side) * step
        work -= 0.5 * (before[1] + tendon.mechanism_side) * give
        kept = 0.5 * (tendon.spool_side**2 / ka + tendon.mechanism_side**2 / kb)
        assert kept <= work + 1e-9  # [J]
    assert work > kept + 1e-4  # it did slip, and lost what slipping costs


def test_a_slider_never_gains_energy() -> None:
    """Let go from a stretched spring it only loses, and rail friction holds it in the end."""
    c = SliderConstants(damping=0.0, rail_friction=0.3)
    slider = Slider(c)
    slider.excursion, last = 0.03, math.inf
    for _ in range(12_000):
        slider.advance(0.0, 0.0, STEP)
        # a stop that is just entered is ahead by half a step's work: count motion and spring only
        now = 0.5 * (c.mass * slider.excursion_rate**2 + c.stiffness * slider.excursion**2)
        if slider.excursion > 0.0:
            assert now <= last + 1e-12
            last = now
    assert slider.excursion_rate == 0.0
    assert abs(slider.excursion) <= c.rail_friction / c.stiffness


def trace(bench: str, obstacle: str, time_step: float) -> np.ndarray:
    """Return the tension at the load cell [N], 80 times a second, under steps and a sine."""
    plant = Plant(draw_unit(bench, 1), time_step=time_step)
    plant.obstacle = BenchObstacle(grips(obstacle, 3))
    registers = plant.registers
    registers.write(11, bytes([16]), 0)
    registers.write(64, bytes([1]), 0)
    home, tensions = plant.encoder.count, []
    for k in range(8000):
        time = 1e-3 * k
        command = (3.0, 0.5, 6.0, 2.0 + 1.5 * math.sin(4.0 * time))[int(time / 2.0)]
        if k % 50 == 0:
            error = command - (plant.encoder.count - home) * 2.0 * math.pi / 4096.0
            duty = round(885 * (min(0.9, 0.1 * error) + 0.02))
            registers.write(100, duty.to_bytes(2, "little", signed=True), 0)
        plant.tick()
        if k % 12 == 0:
            tensions.append(plant.tendon.spool_side)
    return np.array(tensions)


@pytest.mark.parametrize(
    ("bench", "obstacle"),
    [("finger", "hand_perturbation"), ("spring_strong", "free"), ("spring_weak", "tape_roll")],
)
def test_halving_the_substep_changes_little(bench, obstacle) -> None:
    """The tension changes by less than 0.05 N RMS, and by half as much at the next halving."""
    traces = [trace(bench, obstacle, step) for step in (0.5e-3, 0.25e-3, 0.125e-3)]
    coarse, fine = (np.sqrt(np.mean((a - b) ** 2)) for a, b in pairwise(traces))
    assert fine < 0.05
    assert fine < 0.75 * coarse


def test_a_blocked_finger_stops_at_the_block() -> None:
    """Against a tape roll the spool hardly moves past half closure while the tension rises."""
    blocked = Plant(nominal_unit("finger"))
    blocked.obstacle = BenchObstacle(grips("tape_roll", 0))
    blocked.registers.write(11, bytes([16]), 0)
    blocked.registers.write(64, bytes([1]), 0)
    blocked.registers.write(100, (400).to_bytes(2, "little"), 0)
    for _ in range(2000):
        blocked.tick()
    state = blocked.state()
    assert state.excursion / 0.0125 == pytest.approx(0.87, abs=0.35)
    assert state.tension > 12.0


def test_the_units_are_frozen() -> None:
    """Published figures compare units by seed: nobody changes a constant or its draw in passing."""
    dynamixel, feetech = ("xc330_t288_t", "xl330_m288_t"), ("sts3215", "sts3250")
    assert {*dynamixel, *feetech} == set(SERVOS)
    assert digest(dynamixel, "spring_weak", "spring_strong", "finger") == "010885a73a7dfc0e"
    assert digest(dynamixel, "finger_antagonist") == "50ccdc925e015efb"
    assert digest(feetech, "spring_weak", "spring_strong", "finger") == "30c0a0f29bcd5d88"
    assert digest(feetech, "finger_antagonist") == "9ae8f5402c7880d9"


def digest(servos: Sequence[str], *benches: str) -> str:
    """Return what tells the units of some benches, with some servos, from others."""
    units = [
        draw_unit(bench, seed, servo)
        for bench in benches
        for seed in BENCH_SEEDS
        for servo in servos
    ]
    drawn = "".join(f"{unit}{unit.further or ''}" for unit in units)
    drawn = re.sub(r"\w+\(", "(", drawn)  # classes may have other names
    return hashlib.sha256(drawn.encode()).hexdigest()[:16]
