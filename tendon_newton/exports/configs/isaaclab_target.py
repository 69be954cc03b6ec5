"""Export to Isaac Lab: the bench in USD, and a file with the actuator's configuration.

Isaac Lab drives joints: each tendon must drive one joint, and the command is that joint's position.
"""

from pathlib import Path
from typing import Any

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports import model_numbers
from tendon_newton.exports.bench_file import write_bench
from tendon_newton.exports.configs import text
from tendon_newton.exports.configs.students import HISTORY, Scales
from tendon_newton.exports.export_target import Coverage, Exported, ExportTarget
from tendon_newton.exports.linking import Text
from tendon_newton.exports.newton.newton_target import (
    BENCH_FILE,
    PLAIN_FILE,
    corrected_bench,
    written_prims,
)
from tendon_newton.exports.newton.plain import IN_THE_PRIMS
from tendon_newton.exports.newton.prims import drives_one_joint, gearing_of, joint_drive
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon

# Delays are whole steps of the physics, friction is the solver's, springs only Newton reads
COVERAGE: dict[str, Coverage] = {
    **IN_THE_PRIMS,
    "command_delay": "approximate",
    "joint_stiffness_error": "approximate",
    "tendon_slack": "none",
}
IMPORTS = [
    "from pathlib import Path",
    "",
    "from isaaclab.actuators import ActuatorNetMLPCfg, DCMotorCfg, DelayedPDActuatorCfg",
    "",
    "FOLDER = Path(__file__).resolve().parent",
]
IMPORTS_HEAD = "The servo of the bench {bench} for Isaac Lab 3.0, for physics steps of {step:g} s."


def write_isaaclab_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write `bench.usda` and `servo_cfg.py`, and the network of a learned servo.

    Raises:
        InvalidModelFile: A tendon drives several joints, or the actuator has no force.
        InvalidOutput: A file cannot be written.
    """
    model_numbers.refuse_damaged(model, "Isaac Lab")
    for tendon in mechanism.tendons:
        if not drives_one_joint(tendon):
            raise InvalidModelFile(
                f"Isaac Lab's actuators drive a joint each; the tendon {tendon.name!r} of "
                f"{mechanism.name!r} drives several. Its Newton backend can run --to newton"
            )
    learned, note, network = text.write_network(folder, mechanism, model)
    correction = corrected_bench(mechanism, model)
    write_bench(folder / BENCH_FILE, correction, model)
    entries = {
        tendon.name: entry(mechanism, tendon, model, learned) for tendon in mechanism.tendons
    }
    title = IMPORTS_HEAD.format(bench=mechanism.name, step=text.PHYSICS_STEP)
    write_text(folder / text.CONFIG_FILE, text.config_text(title, IMPORTS, entries))
    gears = [gearing_of(tendon, model) for tendon in mechanism.tendons]
    targets = "\n".join(
        f"    {tendon.name}: (angle - {gear.shift - gear.lead:.8g}) / {gear.ratio:.8g}"
        for tendon, gear in zip(mechanism.tendons, gears, strict=True)
    )
    plain = written_prims(folder, mechanism, model)
    prims = [] if plain is None else [PLAIN_FILE]
    files = (BENCH_FILE, text.CONFIG_FILE, *prims)
    ways = {text.CONFIG_FILE: COVERAGE, **dict.fromkeys(prims, IN_THE_PRIMS)}
    return Exported(
        files=(*(folder / name for name in files), *network),
        loading=LOADING.format(
            targets=targets, note=note, gravity=text.gravity_text(correction.corrected.gravity)
        ),
        replays={} if plain is None else {PLAIN_FILE: plain},
        left_out={way: model_numbers.not_exact(model, has) for way, has in ways.items()},
        nearly={way: model_numbers.nearly(model, has) for way, has in ways.items()},
        checked=CHECKED + (REPLAYED if prims else ""),
    )


def entry(
    mechanism: Mechanism, tendon: Tendon, model: Model, learned: Scales | None
) -> tuple[str, dict[str, Any]]:
    """Return the class of an actuator's configuration, and its numbers by field."""
    ratio = gearing_of(tendon, model).ratio
    (j,) = (k for k, arm in enumerate(tendon.moment_arm) if arm != 0.0)
    joint, arm = mechanism.joints[j], abs(float(tendon.moment_arm[j]))
    slides, sticks = model_numbers.dry_friction(model)
    own = joint.friction
    numbers: dict[str, Any] = {
        "joint_names_expr": [joint.name],
        "armature": float(model.actuator.values.get("armature", 0.0)) * ratio**2,
        "friction": own + sticks * arm,
        "dynamic_friction": own + slides * arm,
    }
    late = round(model_numbers.number(model, "command_delay", "delay") / text.PHYSICS_STEP)
    if learned is not None:
        pos, vel, effort = learned
        limit = model_numbers.motor_limit(tendon, model) * arm
        return "ActuatorNetMLPCfg", {
            **numbers,
            "network_file": Text(f'str(FOLDER / "{text.NETWORK_FILE}")'),
            "pos_scale": pos * ratio,
            "vel_scale": vel * ratio,
            "torque_scale": effort * float(tendon.moment_arm[j]),
            "input_order": "pos_vel",
            "input_idx": list(range(HISTORY)),
            "saturation_effort": limit,
            "actuator_effort_limit": limit,
            "actuator_velocity_limit": text.FAST,
        }
    _, servo = joint_drive(tendon, model)
    numbers |= {
        "stiffness": servo["kp"],
        "damping": servo["kd"],
        "actuator_effort_limit": servo["maxEffort"],
    }
    if "saturationEffort" in servo and not late:
        return "DCMotorCfg", {
            **numbers,
            "saturation_effort": servo["saturationEffort"],
            "actuator_velocity_limit": servo["velocityLimit"],
        }
    return "DelayedPDActuatorCfg", {**numbers, "min_delay": late, "max_delay": late}


CHECKED = """`servo_cfg.py` was not run: Isaac Lab needs a GPU and versions of Newton and Warp of
its own. The names of all fields are checked against its classes (Isaac Lab 3.0.0). A string pushes
there as hard as it pulls."""
REPLAYED = """ `bench_newton.usda` was run, by Newton at steps of 0.1 ms: it has the same numbers
as prims, which Isaac Lab 3 takes too."""
LOADING = """```python
from isaaclab.assets import ArticulationCfg
import isaaclab.sim as sim_utils
from servo_cfg import ACTUATORS

BENCH_CFG = ArticulationCfg(
    spawn=sim_utils.UsdFileCfg(usd_path="bench.usda"),
    actuators=ACTUATORS,
    ...
)
```

Give `SimulationCfg` this `gravity` [m/s2]: `{gravity}`. The file's own is not read.

The target is a joint's position [rad, m]. Of a desired motor angle [rad] it is:

{targets}
{note}
A servo with a late command is a `DelayedPDActuatorCfg`, which has no limit of a motor's voltage.
PhysX does not read the return springs (`mjc:stiffness`); Newton's
backend does.
"""

ISAACLAB = ExportTarget(coverage=COVERAGE, write=write_isaaclab_target)
