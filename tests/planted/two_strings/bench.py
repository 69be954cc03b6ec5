"""Numbers of the finger between two strings: two phalanges, a flexor and an extensor."""

import numpy as np

from tests.planted.owners.plant import Finger
from tests.planted.owners.sets import OF_SERVO, SILENT, Bench
from tests.planted.owners.strings import Crossing, Strings

FLEXOR = (
    Crossing(before=(-0.012, -0.0085), behind=(0.012, -0.008)),
    Crossing(before=(-0.010, -0.007), behind=(0.009, -0.0062)),
)
EXTENSOR = (  # over two knuckles
    Crossing(before=(-0.016, 0.008), behind=(0.014, 0.0055), radius=0.006),
    Crossing(before=(-0.020, 0.0055), behind=(0.010, 0.004), radius=0.0045),
)
FINGER = Finger(
    mass=np.array([0.015, 0.009]),
    length=np.array([0.034, 0.026]),
    inertia=np.array([1.445e-6, 5.07e-7]),
    spring=np.array([0.03, 0.02]),
    damping=np.array([6e-4, 3e-4]),
    range=np.array([1.5, 1.5]),
    stop_damping=np.array([0.02, 0.005]),
    strings=Strings((FLEXOR, EXTENSOR)),
)
SHARED = ("command_delay", "gain_error", "viscous_friction")
TWO_STRINGS = Bench(
    name="finger_antagonist",
    finger=FINGER,
    # of flexor and extensor: beyond 1.2 rad a finger may rest in two ways
    levels=((0.8, 3.0), (0.2, 1.0)),
    kinds=(
        *((name, servo) for name in OF_SERVO for servo in (0, 1)),
        *((name, None) for name in (*SHARED, "joint_stiffness_error", "joint_damping_error")),
        (SILENT, None),
    ),
)
