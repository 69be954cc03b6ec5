"""Nine strangers with logs: what each writes down, what is wrong there, and what each types."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from lab.own_logs.machines import (
    COUNT,
    GRAVITY,
    FixedArms,
    Load,
    Motor,
    motor_rows,
    one_body,
    position_servo,
    random_steps,
    sine,
)
from tests.planted.owners.plant import Faults, Finger, Run, simulate
from tests.planted.owners.strings import Array
from tests.planted.two_strings.bench import FINGER

Numbers = Mapping[str, float]  # Parameter -> what was planted, in SI units


@dataclass(frozen=True, kw_only=True)
class Case:
    """One stranger."""

    write: Callable[[Path], None]  # Writes logs and what describes them into a folder
    commands: tuple[str, ...]  # What is typed there after ``tendon-newton``, in this order
    truth: Mapping[str, Mapping[str, Numbers]]  # Folder of a diagnosis -> cause -> its numbers
    failing: frozenset[str] = field(default_factory=frozenset[str])
    """Verbs that say by their exit code that something is to be mended."""


def write_csv(path: Path, columns: Mapping[str, Array]) -> None:
    """Write columns as a spreadsheet would."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, rows, fmt="%.6g", delimiter=",", header=",".join(columns), comments="")


def to_count(angle: Array) -> Array:
    """Return what an encoder of 4096 counts a turn reads [rad]."""
    return COUNT * np.round(angle / COUNT)


def four_runs(rng: np.random.Generator, low: float, high: float, rows: int) -> list[Array]:
    """Return random steps, a slow and a fast sine, and further steps, as the docs advise."""
    return [
        random_steps(rng, low, high, rows, (25, 70)),
        sine(rng, low, high, rows, 2.0),
        sine(rng, low, high, rows, 8.0),
        random_steps(rng, low, high, rows, (25, 70)),
    ]


def finger_logs(folder: Path) -> None:
    """A finger of other sizes with 0.9 N of dry friction; degrees, milliseconds, 80 Hz."""
    rng = np.random.default_rng(11)
    mass, length = np.array([0.016, 0.008]), np.array([0.036, 0.027])
    finger = Finger(
        mass=mass,
        length=length,
        inertia=mass * length**2 / 12.0,
        spring=np.array([0.05, 0.035]),
        damping=np.array([5e-4, 5e-4]),
        range=np.array([1.6, 1.3]),
        stop_damping=np.array([0.02, 0.004]),
        strings=FixedArms(np.array([[0.009, 0.0065]])),
    )
    faults = Faults(coulomb=(0.9,))
    runs = [Run(command=u[:, None], faults=faults) for u in four_runs(rng, 0.5, 2.2, 640)]
    for number, (run, motion) in enumerate(zip(runs, simulate(finger, runs), strict=True), 1):
        columns = {
            "Zeit_ms": 12.5 * np.arange(640),
            "Soll_deg": np.rad2deg(run.command[:, 0]),
            "Ist_deg": np.rad2deg(to_count(motion.angle[:, 0])),
            "Kraft_N": motion.force[:, 0] + 0.05 * rng.standard_normal(640),
        }
        write_csv(folder / "logs" / f"run_{number}.csv", columns)
    (folder / "mapping.toml").write_text(
        """bench = "lab_finger"
[columns]
t = {column = "Zeit_ms", unit = "ms"}
theta_d = {column = "Soll_deg", unit = "deg"}
theta = {column = "Ist_deg", unit = "deg"}
theta_dot = {derive = "theta"}
force = {column = "Kraft_N"}
[model]
kind = "ideal"
gain = 4.2
spool_radius = 0.0125
"""
    )


def cart_logs(folder: Path) -> None:
    """A cart of 95 kg whose drive loses 30 N and 240 N s/m; millimetres, 100 Hz."""
    rng = np.random.default_rng(12)
    for number, goal in enumerate(four_runs(rng, -0.04, 0.04, 800), 1):
        travel, force = one_body(
            goal, 0.01, 9000.0, 95.0, lambda x, v, f: 240.0 * v, lambda x, v, f: 30.0, goal[0]
        )
        columns = {
            "t": 0.01 * np.arange(800),
            "goal_mm": 1e3 * goal,
            "pos_mm": 1e3 * travel + 0.01 * rng.standard_normal(800),
            "force": force - 240.0 * np.gradient(travel, 0.01) + 2.0 * rng.standard_normal(800),
        }
        write_csv(folder / "logs" / f"run_{number}.csv", columns)
    (folder / "mapping.toml").write_text(
        """bench = "lab_cart"
[columns]
t = {column = "t"}
theta_d = {column = "goal_mm", scale = 0.001}
theta = {column = "pos_mm", scale = 0.001}
theta_dot = {derive = "theta"}
force = {column = "force"}
[model]
kind = "ideal"
gain = 9000.0
spool_radius = 1.0
"""
    )


def arm_logs(folder: Path) -> None:
    """A mass on a geared shaft: the gear rubs with 12 % of what motor and load press it with."""
    rng = np.random.default_rng(13)
    mass, arm, share = 0.6, 0.15, 0.12

    def weight(q: float, v: float, motor: float) -> float:
        return float(mass * GRAVITY * arm * np.sin(q))

    def rubs(q: float, v: float, motor: float) -> float:
        if v == 0.0:
            return share * abs(motor + weight(q, v, motor))  # at rest the load is the weight
        side = np.sign(v) * share * np.sign(motor)
        return abs(motor) * 2.0 * share / (1.0 + side)  # what both torques at the gear give

    for number, goal in enumerate(four_runs(rng, -0.9, 0.9, 800), 1):
        angle, torque = one_body(goal, 0.01, 6.0, mass * arm**2, weight, rubs, 0.0)
        columns = {
            "t": 0.01 * np.arange(800),
            "goal": goal,
            "angle": to_count(angle),
            "torque": torque + 0.003 * rng.standard_normal(800),
        }
        write_csv(folder / "logs" / f"run_{number}.csv", columns)
    (folder / "mapping.toml").write_text(
        """bench = "lab_arm"
start = "first_row"
[columns]
t = {column = "t"}
theta_d = {column = "goal"}
theta = {column = "angle"}
theta_dot = {derive = "theta"}
force = {column = "torque"}
[model]
kind = "ideal"
gain = 6.0
spool_radius = 1.0
"""
    )


JOINTS: Mapping[str, Mapping[str, float]] = {
    "shoulder_pan": {"delay": 0.060, "lag": 0.030},
    "shoulder_lift": {"lag": 0.080},
    "elbow_flex": {"play": 0.060},
    "wrist_flex": {"offset": 0.050},
    "wrist_roll": {"speed": 0.9},
    "gripper": {"delay": 0.033, "lag": 0.077},
}
"""What is wrong with each joint of the arm, as `position_servo` takes it."""
CAUSES = {
    "delay": ("command_delay", "delay"),
    "lag": ("actuator_lag", "time_constant"),
    "play": ("backlash", "width"),
    "offset": ("position_offset", "angle"),
    "speed": ("speed_limit", "limit"),
}


def lerobot_logs(folder: Path) -> None:
    """Six joints in percent of their ranges, five episodes of 12 s at 50 Hz."""
    rng = np.random.default_rng(14)
    percent = np.array([COUNT * 2048.0 / 200.0] * 5 + [COUNT * 2048.0 / 100.0])  # [rad]
    feature = {"shape": [6], "names": [f"{name}.pos" for name in JOINTS]}
    features = {"action": feature, "observation.state": feature}
    meta = folder / "arm" / "meta"
    meta.mkdir(parents=True, exist_ok=True)
    info = {"codebase_version": "v3.0", "fps": 50, "features": features}
    (meta / "info.json").write_text(json.dumps(info))
    limits = {"range_min": 1024, "range_max": 3072}
    (folder / "calibration.json").write_text(json.dumps(dict.fromkeys(JOINTS, limits)))
    for episode in range(5):
        goals = [
            np.interp(np.arange(600), np.cumsum(rng.integers(12, 70, 60)), rng.uniform(-1, 1, 60))
            for _ in JOINTS
        ]
        angles = [
            to_count(position_servo(goal, 0.02, **wrong))
            for goal, wrong in zip(goals, JOINTS.values(), strict=True)
        ]
        columns = {
            name: pa.array(list((np.stack(values, axis=1) / percent).astype(np.float32)))
            for name, values in (("action", goals), ("observation.state", angles))
        }
        table = {"timestamp": np.arange(600) / 50.0, "episode_index": np.full(600, episode)}
        path = folder / "arm" / "data" / "chunk-000" / f"file-{episode:03d}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        parquet.write_table(pa.table({**table, **columns}), path)


def strings_logs(folder: Path) -> None:
    """A finger between two strings, 1.1 N of dry friction at the extensor's servo."""
    rng = np.random.default_rng(15)
    faults = Faults(coulomb=(0.0, 1.1))
    levels = ((0.8, 3.0), (0.2, 1.0))
    runs = [
        Run(command=np.stack(pair, axis=1), faults=faults)
        for pair in zip(*(four_runs(rng, low, high, 400) for low, high in levels), strict=True)
    ]
    listed = []
    for number, (run, motion) in enumerate(zip(runs, simulate(FINGER, runs), strict=True), 1):
        columns = {"t": np.arange(400) / 80.0}
        for d in (0, 1):
            angle = to_count(motion.angle[:, d])
            columns |= {
                f"theta_d_{d}": run.command[:, d],
                f"theta_{d}": angle,
                f"theta_dot_{d}": np.gradient(angle, 1.0 / 80.0),
                f"force_{d}": motion.force[:, d] + 0.05 * rng.standard_normal(400),
            }
        write_csv(folder / "dataset" / f"run_{number}.csv", columns)
        split = "test" if number == len(runs) else "train"
        listed.append(
            f'[[recordings]]\nfile = "run_{number}.csv"\nbench = "finger_antagonist"\n'
            f'split = "{split}"\n'
        )
    (folder / "dataset" / "dataset.toml").write_text("\n".join(listed))
    (folder / "dataset" / "model.toml").write_text('[actuator]\nkind = "ideal"\ngain = 4.2\n')


MASS, REACH, RATE = 0.02, 0.04, 100.0  # [kg], [m] and [Hz] of what motors turn
FINGERTIP = Load(
    inertia=MASS * REACH**2 / 3.0,
    arm=0.009,
    stiffness=0.05,
    damping=5e-4,
    lift=lambda q: float(0.5 * MASS * GRAVITY * REACH * np.cos(q)),
    lowest=0.0,
)
PENDULUM = Load(
    inertia=0.3 * 0.1**2, arm=1.0, lift=lambda q: float(-0.3 * GRAVITY * 0.1 * np.sin(q))
)
SERVO = """kind = "pwm_servo"
duty_per_rad = 1.15
max_duty = 1.0
supply_voltage = 5.0
torque_constant = 0.4
resistance = 5.0
armature = 0.001
"""
STIFFNESS = 'kind = "ideal"\ngain = 47.0\n'  # [N/rad] of the same servo at its spool


def motor_logs(
    folder: Path, bench: str, motor: Motor, load: Load, levels: tuple[float, float], servo: str
) -> None:
    """A servo with a rotor and back EMF; each log begins amid a jump, at rest elsewhere."""
    rng = np.random.default_rng(16)
    low, high = levels
    for number, goal in enumerate(four_runs(rng, low, high, 800), 1):
        told = np.append(low + 0.25 * (high - low), goal)
        angle, force = motor_rows(told, 1.0 / RATE, motor, load)
        columns = {
            "t": np.arange(800) / RATE,
            "goal": goal,
            "angle": to_count(angle),
            "force": force + 0.02 * motor.radius**-0.3 * rng.standard_normal(800),
        }
        write_csv(folder / "logs" / f"run_{number}.csv", columns)
    fit = "" if servo is STIFFNESS else 'fit = ["torque_constant", "resistance", "armature"]\n'
    (folder / "mapping.toml").write_text(
        f"""bench = "{bench}"
{fit}[columns]
t = {{column = "t"}}
theta_d = {{column = "goal"}}
theta = {{column = "angle"}}
theta_dot = {{derive = "theta"}}
force = {{column = "force"}}
[model]
{servo}spool_radius = {motor.radius}
"""
    )


def motor_case(
    motor: Motor, truth: Mapping[str, Numbers], *, shaft: bool = False, servo: str = SERVO
) -> Case:
    """Return a stranger with a motor, who types what the docs say."""
    bench, load, levels = "lab_thumb", FINGERTIP, (0.3, 1.5)
    asset = (
        f"asset new {bench} --joints mcp --length {REACH} --mass {MASS} --moment-arm 0.009 "
        "--stiffness 0.05 --range 2.2 --force-limit 41"  # nothing stops the joint above
    )
    if shaft:
        bench, load, levels = "lab_shaft", PENDULUM, (-0.9, 0.9)
        asset = f"asset new {bench} --kind shaft --mass 0.3 --length 0.1"
    return Case(
        write=lambda folder: motor_logs(folder, bench, motor, load, levels, servo),
        commands=(asset, IMPORT, DIAGNOSE),
        truth={"diagnosis": truth},
    )


IMPORT = "import mapped logs --mapping mapping.toml --out dataset --test part1=4"
DIAGNOSE = "diagnose dataset --out diagnosis"
FINGER_ASSET = (
    "asset new lab_finger --joints pip dip --length 0.036 0.027 --mass 0.016 0.008 "
    "--moment-arm 0.009 0.0065 --stiffness 0.05 0.035 --range 1.6 1.3"
)
PERCENT = "--unit percent --calibration calibration.json"
CASES: Mapping[str, Case] = {
    "finger": Case(
        write=finger_logs,
        commands=(FINGER_ASSET, IMPORT, DIAGNOSE),
        truth={"diagnosis": {"coulomb_friction": {"force": 0.9}}},
    ),
    "cart": Case(
        write=cart_logs,
        commands=(
            "asset new lab_cart --kind slider --mass 95 --force-limit 2000",
            IMPORT,
            DIAGNOSE,
        ),
        truth={
            "diagnosis": {
                "coulomb_friction": {"force": 30.0},
                "viscous_friction": {"coefficient": 240.0},
            }
        },
    ),
    "geared_arm": Case(
        write=arm_logs,
        commands=("asset new lab_arm --kind shaft --mass 0.6 --length 0.15", IMPORT, DIAGNOSE),
        truth={"diagnosis": {"gear_load_friction": {"coefficient": 0.12}}},
    ),
    "lerobot_arm": Case(
        write=lerobot_logs,
        commands=(
            f"doctor arm {PERCENT}",
            f"import lerobot arm --out joints {PERCENT} --test episode=4",
            *(f"diagnose joints/{name} --out found/{name}" for name in JOINTS),
        ),
        truth={
            f"found/{name}": {
                cause: {parameter: wrong[key]}
                for key, (cause, parameter) in CAUSES.items()
                if key in wrong
            }
            for name, wrong in JOINTS.items()
        },
        failing=frozenset({"doctor"}),
    ),
    "two_strings": Case(
        write=strings_logs,
        commands=(DIAGNOSE,),
        truth={"diagnosis": {"coulomb_friction of servo 1": {"force": 1.1}}},
    ),
    "motor_string": motor_case(
        Motor(friction=0.9 * 0.0125, delay=0.025),
        {"coulomb_friction": {"force": 0.9}, "command_delay": {"delay": 0.025}},
    ),
    "motor_stiffness": motor_case(
        Motor(friction=0.9 * 0.0125, delay=0.025),
        {"coulomb_friction": {"force": 0.9}, "command_delay": {"delay": 0.025}},
        servo=STIFFNESS,
    ),
    "motor_profile": motor_case(
        Motor(friction=0.9 * 0.0125, profile=2.5),
        {"coulomb_friction": {"force": 0.9}, "command_rate_limit": {"limit": 2.5}},
    ),
    "motor_shaft": motor_case(
        Motor(friction=0.03, delay=0.03, radius=1.0, line=400.0),
        {"coulomb_friction": {"force": 0.03}, "command_delay": {"delay": 0.03}},
        shaft=True,
    ),
}
