"""The plant's servo with a rotor, its gear and the causes in both, against closed forms."""

import numpy as np
import pytest

from tests.physics.ledger import STIFFNESS, Books, jumps_of, one_step, random_steps
from tests.planted.physics.bench import BENCHES, SPOOL_RADIUS
from tests.planted.physics.causes import Causes
from tests.planted.physics.disturbances import Knock
from tests.planted.physics.plant import Motion, Run, simulate
from tests.planted.physics.servo import DcServo
from tests.planted.trials import FROZEN, SERVO, Array, jump, rows, run

STALL = SERVO.supply * SERVO.torque_per_volt / SPOOL_RADIUS  # [N] at full duty
BRAKE = SERVO.torque_constant * SERVO.torque_per_volt / SPOOL_RADIUS  # [N s/rad]
RATE = 10_000.0  # [Hz] that a string of 5 N/um and 50 g need
LOOSE = 1.0  # [m] of string, so that nothing holds the rotor
RAMP = rows(2.0, rate=5000.0)
SLIDE = slice(5000, -1)


def test_a_stalled_servo_pulls_with_duty_times_its_stall_force() -> None:
    """F = k_t u V / (R r), with the mechanism frozen."""
    time = rows(1.0)
    causes = Causes(inertia_scale=FROZEN)
    motion = run("spring_weak", causes, time, jump(time, 1.0, 2.0), servo=SERVO)
    expected = STALL * 0.1 * (2.0 - motion.angle[-1])
    assert motion.force[-1] == pytest.approx(expected, rel=1e-5)  # the last of its approach


def test_a_free_rotor_nears_the_speed_at_which_its_emf_is_the_voltage() -> None:
    """theta_dot = u V / k_t (1 - exp(-t k_t^2 / (J R))): torque over inertia at first."""
    time = rows(0.1, rate=1000.0)
    weak = DcServo(**{**vars(SERVO), "greatest_duty": 0.2})
    taut = LOOSE / SPOOL_RADIUS
    command = jump(time, taut, taut - 60.0, 0.01)
    free = run("spring_weak", Causes(slack=LOOSE), time, command, servo=weak)
    assert np.all(free.force == 0.0)
    constant = weak.inertia * weak.resistance / weak.torque_constant**2
    since = np.maximum(time - 0.01, 0.0)
    expected = 0.2 * weak.supply / weak.torque_constant * np.expm1(-since / constant)
    # a kick hears its command at once, and a row sees it half a step later: 6e-4 of the first
    assert free.speed == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())


@pytest.mark.parametrize("commands", [one_step, random_steps])
@pytest.mark.parametrize("bench", STIFFNESS)
def test_the_string_carries_what_moves_the_slider(bench, commands) -> None:
    """F = m x'' + c x' + k x in every row, and the string's work is stored or lost: 1e-4."""
    command = commands(RATE)
    time = np.arange(command.size) / RATE
    made = Run(
        bench=BENCHES[bench],
        causes=Causes(coulomb=0.5, load=0.1),
        time=time,
        command=command,
        servo=SERVO,
    )
    (motion,) = simulate([made])
    books = Books(
        bench=bench,
        time=time,
        slide=motion.coordinates[:, 0],
        force=motion.force,
        jumps=jumps_of(command),
    )
    # the string settles within half a millisecond, five rows: their spline is 0.02 N off
    assert np.abs(books.imbalance()).max() < 0.05
    assert np.sqrt(np.mean(books.imbalance() ** 2)) < 5e-4
    done, kept = books.work()
    assert done == pytest.approx(kept, rel=1e-4)


def pulled(causes: Causes, rate: float) -> tuple[Motion, Array, Array]:
    """Pull steadily; return the motion, and what motor and rotor take part with in it [N]."""
    command = 4.0 + rate * (RAMP - 1.0)
    motion = run("spring_weak", causes, RAMP, command, servo=SERVO)
    motor = STALL * 0.1 * (command - motion.angle)[SLIDE] - BRAKE * motion.speed[SLIDE]
    rotor = SERVO.inertia / SPOOL_RADIUS * np.gradient(motion.speed, RAMP[1])[SLIDE]
    return motion, motor, rotor


@pytest.mark.parametrize("rate", [0.8, -0.8])
def test_the_gear_keeps_its_share_before_the_string(rate: float) -> None:
    """Turning steadily the string has the motor's force less all of the gear's friction."""
    motion, motor, rotor = pulled(Causes(coulomb=0.6, load=0.1, viscous=1.2), rate)
    sense = np.sign(rate)
    expected = (motor - 1.2 * motion.speed[SLIDE] - 0.6 * sense - rotor) / (1.0 + 0.1 * sense)
    assert motion.force[SLIDE] == pytest.approx(expected, abs=5e-3)


@pytest.mark.parametrize("rate", [0.8, -0.8])
def test_a_loaded_gear_keeps_a_share_of_what_presses_its_teeth(rate: float) -> None:
    """F = F_m (1 - K) / (1 + K) driving, F_m (1 + K) / (1 - K) driven (BAM's K |F_m + F|)."""
    motion, motor, rotor = pulled(Causes(gear_load=0.1), rate)
    share = 0.1 * np.sign(rate)
    expected = (motor * (1.0 - share) - rotor) / (1.0 + share)
    assert motion.force[SLIDE] == pytest.approx(expected, abs=5e-3)


def test_gear_and_guide_stick_each_on_its_own() -> None:
    """A hand moves the slider: the string stretches through its guides, the gear stays stuck."""
    time = rows(1.0)
    causes = Causes(compliance=1.0 / 3e3, coulomb=6.0, routing=0.1, bristle=2e-7)
    made = Run(
        bench=BENCHES["spring_weak"],
        causes=causes,
        time=time,
        command=np.full(time.size, 3.0),
        knocks=(Knock(start=0.3, width=0.3, peak=2.0),),
    )
    (motion,) = simulate([made])
    slid = motion.coordinates[:, 0] - motion.coordinates[0, 0]
    turned = SPOOL_RADIUS * (motion.angle - motion.angle[0])
    assert slid.max() > 3e-4
    assert np.abs(turned).max() < 10.0 * causes.bristle
    # the string's give and nothing else, as the gear holds
    given = (motion.force - motion.force[0]) * causes.compliance
    assert slid + given == pytest.approx(turned, abs=1e-9)
    # afterwards the guides hold the slider off where it was
    assert 1e-6 < abs(slid[-1]) < 0.5 * slid.max()
