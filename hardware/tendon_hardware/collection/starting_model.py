"""The model that a diagnosis of fresh recordings starts from: the servo's data sheet and its loop.

Servo, mode and bench are known while something is recorded, so nobody has to write the file.
"""

from pathlib import Path

from tendon_hardware.servos.base import ServoSpec
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_newton.data.model_file import Model, NamedValues, write_model

MODEL_FILE = "model.toml"
"""Name of the model beside a dataset's recordings."""
UNKNOWN = ("torque_constant", "resistance")
"""Numbers that every fit may change: the data sheet's are of another voltage, without a spread."""


def starting_model(
    spec: ServoSpec, loop: HostPositionLoop, *, voltage: float, spool_radius: float
) -> Model:
    r"""Return a servo in PWM mode behind the position loop of this computer.

    .. math:: R = V_0 / I_0, \qquad k_t = \tau_0 / I_0

    with stall torque and current at the data sheet's voltage.

    Args:
        voltage: Supply that the servo measures [V].
        spool_radius: Radius of its spool [m].
    """
    values = {
        "duty_per_rad": loop.gain,
        "max_duty": loop.duty_limit,
        "duty_offset": loop.offset,
        "supply_voltage": round(voltage, 2),
        "torque_constant": round(spec.stall_torque / spec.stall_current, 4),
        "resistance": round(spec.supply_voltage / spec.stall_current, 3),
        "armature": spec.armature,
        "spool_radius": spool_radius,
    }
    return Model(actuator=NamedValues(name="pwm_servo", values=values), fit=UNKNOWN)


def leave_model(folder: Path, model: Model) -> None:
    """Write a folder's model unless it has one, which may be edited by hand."""
    if not (folder / MODEL_FILE).exists():
        write_model(folder / MODEL_FILE, model)
