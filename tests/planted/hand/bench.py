"""Numbers of a hand's fingers: three phalanges, and a flexor over a pulley in the palm."""

import numpy as np

from tests.planted.owners.plant import Finger
from tests.planted.owners.sets import ANY, FAULTS, OF_MECHANISM, SILENT, Bench
from tests.planted.owners.strings import Crossing, Strings

FINGERS = 4
FLEXOR = (
    Crossing(
        before=(-0.032, -0.0105), behind=(0.012, -0.0085), pulley=(-0.014, -0.0165), radius=0.005
    ),
    Crossing(before=(-0.012, -0.0075), behind=(0.011, -0.0068)),
    Crossing(before=(-0.006, -0.006), behind=(0.006, -0.005)),
)
FINGER = Finger(
    mass=np.array([0.018, 0.010, 0.006]),
    length=np.array([0.042, 0.026, 0.021]),
    inertia=np.array([2.646e-6, 5.63333e-7, 2.205e-7]),
    spring=np.array([0.075, 0.045, 0.028]),
    damping=np.array([8e-4, 4e-4, 2e-4]),
    range=np.array([1.45, 1.6, 1.2]),
    stop_damping=np.array([0.02, 0.006, 0.002]),
    strings=Strings((FLEXOR,)),
)
SHARED = ("command_delay", "gain_error", "viscous_friction", "actuator_lag", *OF_MECHANISM)
CLEAN = 4
HAND = Bench(
    name="hand",
    finger=FINGER,
    levels=FINGERS * ((0.0, 3.2),),  # from slack to nearly closed
    kinds=(
        *((name, ANY) for name in FAULTS),
        *((name, None) for name in SHARED),
        *CLEAN * ((SILENT, None),),
    ),
)
