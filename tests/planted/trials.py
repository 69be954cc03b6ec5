"""Runs of the plant that the tests share."""

import numpy as np
from numpy.typing import NDArray

from tests.planted.physics.bench import BENCHES, GAIN, SPOOL_RADIUS
from tests.planted.physics.causes import Causes
from tests.planted.physics.plant import STEP, Motion, Run, simulate
from tests.planted.physics.servo import DcServo

Array = NDArray[np.float64]

FINGER = BENCHES["finger"]
WEAK = BENCHES["spring_weak"]
TAUT = GAIN / SPOOL_RADIUS  # [N/m] the servo as a spring
SERVO = DcServo(
    duty_per_rad=0.1,
    greatest_duty=0.9,
    supply=9.0,
    torque_constant=1.43,
    resistance=15.0,
    inertia=0.0025,
)
FROZEN = 1e9  # [1] inertia with which nothing moves


def rows(duration: float, rate: float = 80.0) -> Array:
    """Row instants [s]."""
    return np.arange(round(duration * rate)) / rate


def jump(time: Array, first: float, then: float, at: float = 0.5) -> Array:
    """Command with one jump [rad]."""
    return np.where(time < at - 1e-9, first, then)


def run(
    bench: str,
    causes: Causes,
    time: Array,
    command: Array,
    *,
    step: float = STEP,
    gain: Array | None = None,
    friction: Array | None = None,
    lateness: Array | None = None,
    servo: DcServo | None = None,
) -> Motion:
    """Simulate one recording."""
    made = Run(
        bench=BENCHES[bench],
        causes=causes,
        time=time,
        command=command,
        servo=servo,
        gain=gain,
        friction=friction,
        lateness=lateness,
    )
    return simulate([made], step=step)[0]


def step_response(time: Array, natural: float, decay: float) -> Array:
    """Damped oscillator after a step at t = 0, from 0 to 1 [1]."""
    root = np.sqrt(complex(decay**2 - natural**2))
    after = np.maximum(time, 0.0)
    slow, fast = np.exp((root - decay) * after), np.exp((-root - decay) * after)
    return 1.0 - ((slow + fast) / 2.0 + decay / root * (slow - fast) / 2.0).real
