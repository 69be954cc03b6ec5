"""Export to mjlab: the bench as MJCF, and the configuration of an actuator at its tendon."""

from pathlib import Path
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports import model_numbers
from tendon_newton.exports.configs import text
from tendon_newton.exports.configs.students import HISTORY
from tendon_newton.exports.export_target import Coverage, Exported, ExportTarget
from tendon_newton.exports.linking import Text
from tendon_newton.exports.mujoco.mjcf_servo import armature_of, has_spool
from tendon_newton.exports.mujoco.mjcf_spool import add_spool, spool_name
from tendon_newton.exports.mujoco.mujoco_target import IN_THE_FILE, change_mechanism, placed_tendons
from tendon_newton.mechanisms.authoring.mujoco_file import mujoco_spec, named_apart, write_spec
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon

BENCH_FILE = "bench.xml"
# Delays are whole steps of the physics
COVERAGE: dict[str, Coverage] = {**IN_THE_FILE, "tendon_slack": "approximate"}
IMPORTS = [
    "from pathlib import Path",
    "",
    "from mjlab.actuator import (",
    "    BuiltinDcMotorActuatorCfg,",
    "    BuiltinPositionActuatorCfg,",
    "    DcMotorInputMode,",
    "    DcMotorPhysicalParams,",
    "    LearnedMlpActuatorCfg,",
    ")",
    "from mjlab.actuator.actuator import TransmissionType",
    "",
    "FOLDER = Path(__file__).resolve().parent",
]
TITLE = "The servo of the bench {bench} for mjlab 1.6, for physics steps of {step:g} s."


def write_mjlab_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write `bench.xml` and `servo_cfg.py`, and the network of a learned servo.

    Raises:
        InvalidModelFile: The actuator has no force.
        InvalidOutput: A file cannot be written.
    """
    model_numbers.refuse_damaged(model, "mjlab")
    mechanism = named_apart(mechanism)
    signs, offsets = placed_tendons(mechanism)
    spec = mujoco_spec(mechanism)
    change_mechanism(spec, mechanism, model)
    routed = any(tendon.route is not None for tendon in mechanism.tendons)
    if routed and find_actuator(model.actuator.name).held:
        raise InvalidModelFile(
            "mjlab's network drives see a tendon's length and have no sign for one that shrinks as "
            "it is wound in; a routed tendon needs --to mujoco"
        )
    learned, note, network = text.write_network(folder, mechanism, model)
    rows = list(zip(mechanism.tendons, signs, offsets, strict=True))
    for tendon, sign, offset in rows:
        prepare_string(spec, tendon, model, sign, offset)
    write_spec(folder / BENCH_FILE, spec)
    entries = {t.name: entry(t, model, sign, learned) for t, sign, _ in rows}
    title = TITLE.format(bench=mechanism.name, step=text.PHYSICS_STEP)
    write_text(folder / text.CONFIG_FILE, text.config_text(title, IMPORTS, entries))
    lines = []
    for tendon, sign, offset in rows:
        kind, numbers = entries[tendon.name]
        (target,) = numbers["target_names_expr"]
        lines.append(f"    {target}: {target_text(tendon, model, sign, offset, kind)}")
    return Exported(
        files=(folder / BENCH_FILE, folder / text.CONFIG_FILE, *network),
        loading=LOADING.format(
            targets="\n".join(lines), note=note, gravity=text.gravity_text(spec.option.gravity)
        ),
        left_out={text.CONFIG_FILE: model_numbers.not_exact(model, COVERAGE)},
        nearly={text.CONFIG_FILE: model_numbers.nearly(model, COVERAGE)},
        checked=CHECKED,
    )


def prepare_string(spec: Any, tendon: Tendon, model: Model, sign: float, offset: float) -> None:
    """Give a string what only pulls: its rotor's spool, else a force that has one sign."""
    if has_spool(tendon, model):
        radius = model_numbers.spool_of(tendon, model)
        taut_at = model_numbers.angle_shift(tendon, model, offset)
        add_spool(spec, tendon, radius, armature_of(model), taut_at)
    elif not tendon.direct:
        row, limit = spec.tendon(tendon.name), model_numbers.motor_limit(tendon, model)
        least = -model_numbers.dry_friction(model)[0]  # what it takes to overcome its friction
        row.actfrclimited, row.actfrcrange = True, sorted((sign * least, sign * limit))


def target_text(tendon: Tendon, model: Model, sign: float, offset: float, kind: str) -> str:
    """Return a tendon's target of a desired motor angle [rad]: a length, or a geared one."""
    shift = -model_numbers.command_lead(model)
    if not has_spool(tendon, model):
        shift += model_numbers.angle_shift(tendon, model, offset)
    if kind == "BuiltinDcMotorActuatorCfg":
        return f"angle - {shift:.8g}"
    return f"(angle - {shift:.8g}) * {towards(tendon, model, sign):.8g}"


def towards(tendon: Tendon, model: Model, sign: float) -> float:
    """Return how much the tendon of a servo grows as its motor turns [m/rad]."""
    return (1.0 if has_spool(tendon, model) else sign) * model_numbers.spool_of(tendon, model)


def entry(
    tendon: Tendon, model: Model, sign: float, learned: tuple[float, float, float] | None
) -> tuple[str, dict[str, Any]]:
    """Return the class of an actuator's configuration, and its numbers by field."""
    radius, spool = model_numbers.spool_of(tendon, model), has_spool(tendon, model)
    values = {k: v for k, v in model.actuator.values.items() if isinstance(v, float)}
    lost = model_numbers.number(model, "viscous_friction", "coefficient") / radius  # [N s/m]
    late = round(model_numbers.number(model, "command_delay", "delay") / text.PHYSICS_STEP)
    numbers: dict[str, Any] = {
        "target_names_expr": (spool_name(tendon.name) if spool else tendon.name,),
        "transmission_type": Text("TransmissionType.TENDON"),
        "armature": 0.0 if spool else armature_of(model) / radius**2,  # else the file has it
        "frictionloss": model_numbers.dry_friction(model)[0],
        "viscous_damping": lost,
        "delay_min_lag": late,
        "delay_max_lag": late,
    }
    if learned is not None:
        pos, vel, effort = learned
        limit = model_numbers.motor_limit(tendon, model)
        return "LearnedMlpActuatorCfg", {
            **numbers,
            "network_file": Text(f'str(FOLDER / "{text.NETWORK_FILE}")'),
            "pos_scale": pos / radius,
            "vel_scale": vel / radius,
            "torque_scale": effort,
            "input_order": "pos_vel",
            "history_length": HISTORY,
            "saturation_effort": limit,
            "effort_limit": limit,
            "velocity_limit": text.FAST,
        }
    gains = model_numbers.servo_gains(tendon, model)
    if model.actuator.name == "pwm_servo":
        constant, ohms = values["torque_constant"], values["resistance"]
        return "BuiltinDcMotorActuatorCfg", {
            **numbers,
            "mode": Text("DcMotorInputMode.POSITION"),
            "motor_params": Text(
                f"DcMotorPhysicalParams(kt={constant!r}, ke={constant!r}, resistance={ohms!r})"
            ),
            "stiffness": gains.kp * ohms / constant,  # [V/rad]
            "damping": 0.0,
            "voltage_limit": values["max_duty"] * values["supply_voltage"],
            "gear": 1.0 / towards(tendon, model, sign),
            "effort_limit": gains.limit,
        }
    return "BuiltinPositionActuatorCfg", {
        **numbers,
        "stiffness": gains.kp / radius**2,
        "damping": gains.kd / radius**2,
        "effort_limit": gains.limit / radius,
    }


CHECKED = """It was not run: mjlab needs an environment of its own. The names of all fields are
those of mjlab 1.6.0, which ran files of the benches and servos that docs/export.md lists."""
LOADING = """```python
import mujoco
from mjlab.entity import EntityArticulationInfoCfg, EntityCfg
from servo_cfg import ACTUATORS

BENCH_CFG = EntityCfg(
    spec_fn=lambda: mujoco.MjSpec.from_file("bench.xml"),
    articulation=EntityArticulationInfoCfg(actuators=tuple(ACTUATORS.values())),
)
```

Give the scene this `gravity` [m/s2]: `{gravity}`. An entity's own is not read.

The target is a tendon's (`tendon_len_target`). Of a desired motor angle [rad] it is:

{targets}
{note}
A string only pulls: behind a rotor by a spool of its own, else by the tendon's `actfrcrange`.
"""

MJLAB = ExportTarget(coverage=COVERAGE, write=write_mjlab_target)
