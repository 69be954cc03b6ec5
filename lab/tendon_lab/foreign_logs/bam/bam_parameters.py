r"""Parameter files of Rhoban/bam as a model of ours, and what of theirs ours cannot say.

Their friction is a bound on the torque that stops the shaft,

.. math:: f = f_0 + f_s e + |K_e \tau_e - K_m \tau_m| + |K_{es} \tau_e - K_{ms} \tau_m| e
    + quadratic terms, \qquad e = e^{-(|\omega| / \omega_s)^\alpha}

with the motor's torque :math:`\tau_m` and the load's :math:`\tau_e`; m1 has :math:`f_0` alone, m2
adds :math:`f_s`, m3 and m4 have :math:`K_e = K_m`, m5 has two, m6 adds the quadratic terms.

Source: Duclusaud et al., Extended Friction Models for the Physics Simulation of Servo Actuators
(2025), and ``bam/model.py``.
"""

from collections.abc import Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from tendon_lab.foreign_logs.bam.motors import MOTORS, BamMotor, motor_named
from tendon_newton.data.files.json_file import read_json
from tendon_newton.data.files.text_file import SIZE_LIMIT, finite_number
from tendon_newton.data.gear_friction import quasi_static_gear
from tendon_newton.data.importers.imported import ImportedModel
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.errors import InvalidModelFile, listed, shown

MODELS = ("m1", "m2", "m3", "m4", "m5", "m6")
WORDS = ("model", "actuator")
NUMBERS = (
    "kt",
    "R",
    "armature",
    "q_offset",
    "command_delay",
    "max_velocity",
    "error_gain_ratio",
    "friction_base",
    "friction_stribeck",
    "friction_viscous",
    "dtheta_stribeck",
    "alpha",
    "load_friction_base",
    "load_friction_stribeck",
    "load_friction_motor",
    "load_friction_external",
    "load_friction_motor_stribeck",
    "load_friction_external_stribeck",
    "load_friction_motor_quad",
    "load_friction_external_quad",
)
EXPONENT = 2.0  # Exponent of our Stribeck curves [1]
NOTHING = 1e-3
"""Share of the greatest friction below which a term that is left out is not worth a word [1]."""


def read_parameters(path: Path) -> ImportedModel:
    """Read a parameter file.

    Raises:
        InvalidModelFile: It is none, or of an actuator that no voltage drives.
    """
    table = read_table(path)
    motor = motor_named(str(table["actuator"]), MOTORS)
    if motor is None:
        raise InvalidModelFile(
            f"{path}: the actuator must be one of {listed(MOTORS)}, which a voltage drives; it is "
            f"{shown(table['actuator'])}"
        )
    values = {key: number(path, table, key) for key in NUMBERS if key in table}
    for key in ("kt", "R", "armature"):
        if values.get(key, 0.0) <= 0.0:
            raise InvalidModelFile(f"{path}: {key} must be a positive number")
    for key, value in values.items():
        if key.startswith(("friction", "load_friction")) and not 0.0 <= value < 1.0e3:
            raise InvalidModelFile(f"{path}: {key} must be a friction, 0 or more; it is {value:g}")
    if values.get("load_friction_motor", 0.0) >= 1.0:
        raise InvalidModelFile(f"{path}: load_friction_motor must be below 1, where a gear locks")
    friction, weaker = quasi_static_gear(
        values.get("load_friction_motor", 0.0), values.get("load_friction_external", 0.0)
    )
    actuator = {
        "duty_per_rad": motor.gain * motor.duty_per_gain,
        "max_duty": motor.max_duty,
        "supply_voltage": motor.supply,
        "torque_constant": values["kt"],
        "resistance": values["R"] / weaker,  # torque and back-EMF's torque both shrink
        "armature": values["armature"],
        "spool_radius": 1.0,  # [m] the servo turns the arm directly: force is torque
    }
    effects = tuple(
        NamedValues(name=name, values=row) for name, row in effects_of(values, friction)
    )
    return ImportedModel(
        model=Model(actuator=NamedValues(name="pwm_servo", values=actuator), effects=effects),
        left_out=tuple(left_out(values, motor)),
    )


def effects_of(
    values: Mapping[str, float], two_sided_friction: float
) -> Iterator[tuple[str, dict[str, float]]]:
    """Name the effects that a file's numbers amount to, with their values."""

    def get(key: str) -> float:
        return values.get(key, 0.0)

    if get("command_delay") > 0.0:
        yield "command_delay", {"delay": get("command_delay")}
    if get("max_velocity"):
        yield "command_rate_limit", {"limit": get("max_velocity")}
    if get("q_offset"):  # theirs from encoder to arm, ours from arm to encoder
        yield "position_offset", {"angle": -get("q_offset")}
    if get("error_gain_ratio"):
        yield "gain_error", {"scale": get("error_gain_ratio")}
    if two_sided_friction:
        yield "load_dependent_friction", {"coefficient": two_sided_friction}
    elif get("load_friction_stribeck"):
        base = get("load_friction_base")
        yield (
            "load_stribeck_friction",
            {
                "coefficient": base,
                "static_coefficient": base + get("load_friction_stribeck"),
                "stribeck_velocity": values.get("dtheta_stribeck", 1.0),
            },
        )
    elif get("load_friction_base"):
        yield "gear_load_friction", {"coefficient": get("load_friction_base")}
    if get("friction_stribeck"):
        yield (
            "stribeck_friction",
            {
                "coulomb_force": get("friction_base"),
                "static_force": get("friction_base") + get("friction_stribeck"),
                "stribeck_velocity": values.get("dtheta_stribeck", 1.0),
            },
        )
    elif get("friction_base"):
        yield "coulomb_friction", {"force": get("friction_base")}
    if get("friction_viscous"):
        yield "viscous_friction", {"coefficient": get("friction_viscous")}


def left_out(values: Mapping[str, float], motor: BamMotor) -> Iterator[str]:
    """Say what a file's numbers mean that no effect of ours does."""

    def get(key: str) -> float:
        return values.get(key, 0.0)

    torque = motor.supply * values["kt"] / values["R"]  # [N m] the most that the motor gives
    worth = NOTHING * (
        get("friction_base")
        + torque * max(get("load_friction_base"), get("load_friction_external"), NOTHING)
    )
    for key, power in (("motor", 1), ("external", 1), ("motor", 2), ("external", 2)):
        name = f"load_friction_{key}_{'stribeck' if power == 1 else 'quad'}"
        if get(name) * torque**power > worth:
            kind = "at rest" if power == 1 else "with the square of the torque"
            yield f"{name} = {get(name):.4g}: friction by one side's load {kind}"
    curved = get("friction_stribeck") > worth or get("load_friction_stribeck") * torque > worth
    if curved and abs(get("alpha") - EXPONENT) > 0.05:
        yield f"alpha = {get('alpha'):.3g}: the exponent of our Stribeck curve is {EXPONENT:g}"


def read_table(path: Path) -> dict[str, Any]:
    """Read a parameter file's keys."""
    promise = "parameters of Rhoban/bam are a JSON file"
    table = read_json(path, InvalidModelFile, promise, size_limit=SIZE_LIMIT)
    if any(key not in table for key in WORDS):
        raise InvalidModelFile(
            f"{path}: {promise} with the keys {listed(WORDS)}; it has {listed(table)}"
        )
    if table["model"] not in MODELS:
        raise InvalidModelFile(
            f"{path}: the model must be one of {listed(MODELS)}; it is {shown(table['model'])}"
        )
    return table


def number(path: Path, table: Mapping[str, Any], key: str) -> float:
    """Return one number."""
    value = finite_number(table[key])
    if value is None or not isfinite(value) or abs(value) > 1e6:
        raise InvalidModelFile(
            f"{path}: {key} must be a number of ordinary size; it is {shown(table[key])}"
        )
    return value
