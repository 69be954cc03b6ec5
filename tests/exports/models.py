"""Models that the tests of exports carry into other programs."""

from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.actuators import ACTUATORS as KINDS
from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.effects import EFFECTS
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.departure import Departure, command_range, departure, replayed
from tendon_newton.simulation.hosts.replay import bench_of, rollout_of
from tendon_newton.simulation.hosts.rollout import Candidates
from tendon_newton.simulation.model.parameter_table import spool_radius_of
from tests.made import stated_model
from tests.physics.runs import run_of

ANGLE = 1.5e-3  # rad: one count of a servo's encoder
FORCE = 0.05  # N: below a load cell's noise
NETWORK = Path(__file__).parents[2] / "assets/networks/transformer-simulation-paper-0.safetensors"
IDEAL = {"gain": 4.2, "spool_radius": 0.0125}
PWM = {
    "duty_per_rad": 1.0, "max_duty": 0.9, "supply_voltage": 5.0, "torque_constant": 0.4,
    "resistance": 10.0, "armature": 2.0e-4, "spool_radius": 0.0125,
}  # fmt: skip
LEARNED = {"file": str(NETWORK), "spool_radius": 0.0125}
SHAFT = {**PWM, "spool_radius": 1.0, "armature": 0.002}
SHAFTS = ("pendulum", "servo")
TYPICAL: dict[str, dict[str, float]] = {
    "command_delay": {"delay": 0.03},
    "command_rate_limit": {"limit": 3.0},
    "acceleration_limit": {"limit": 40.0, "speed": 4.0},
    "starting_duty": {"duty": 0.03},
    "overload_cut": {"duty": 0.2, "fraction": 0.1, "time": 0.2},
    "asymmetric_friction": {"winding": 0.7, "unwinding": 0.3},
    "hysteresis": {"force": 0.6, "travel": 0.0005},
    "presliding": {"travel": 0.0002},
    "sample_period_error": {"scale": 1.1},
    "spool_radius_error": {"scale": 1.2},
    "position_offset": {"angle": 0.1},
    "tendon_slack": {"length": 0.002},
    "backlash": {"width": 0.05},
    "deadband": {"width": 0.05},
    "gain_error": {"scale": 1.3},
    "gain_drift": {"rate": 0.03},
    "force_saturation": {"limit": 3.0},
    "voltage_sag": {"sag": 0.03},
    "torque_fade": {"fade": 0.02, "time_constant": 0.7},
    "actuator_lag": {"time_constant": 0.03},
    "viscous_friction": {"coefficient": 0.8},
    "coulomb_friction": {"force": 0.6},
    "stribeck_friction": {"coulomb_force": 0.4, "static_force": 0.8, "stribeck_velocity": 1.0},
    "load_dependent_friction": {"coefficient": 0.15},
    "gear_load_friction": {"coefficient": 0.1},
    "load_stribeck_friction": {
        "coefficient": 0.08,
        "static_coefficient": 0.16,
        "stribeck_velocity": 1.0,
    },
    "holding_friction": {"share": 0.25},
    "tendon_compliance": {"stiffness": 8000.0},
    "speed_limit": {"limit": 4.0},
    "routing_friction": {"exponent": 0.15},
    "obstruction": {"stiffness": 800.0, "position": 0.6, "dissipation": 10.0},
    "joint_stiffness_error": {"scale": 1.2},
    "spring_stiffening": {"beta": 0.8},
    "viscoelastic_spring": {"stiffness_ratio": 0.3, "relaxation_time": 0.4},
    "joint_damping_error": {"scale": 3.0},
    "joint_dry_friction": {"fraction": 0.05},
    "inertia_error": {"scale": 2.0},
    "gravity_misalignment": {"angle": 0.4},
    "load_cell_delay": {"delay": 0.03},
    "load_cell_lag": {"time_constant": 0.03},
    "load_cell_gain": {"scale": 1.1},
    "load_cell_bias": {"offset": 0.3},
    "load_cell_drift": {"rate": 0.05},
    "joint_encoder_delay": {"delay": 0.03},
    "joint_encoder_gain": {"scale": 1.1},
    "tip_sensor_delay": {"delay": 0.03},
    "tip_sensor_gain": {"scale": 1.1},
    "current_sensor_delay": {"delay": 0.03},
    "current_sensor_gain": {"scale": 1.1},
    "voltage_sensor_sag": {"sag": 0.03},
}
"""A number for each effect that shows on the standard commands."""
TORQUE = {"kp": 0.05, "kd": 0.002, "max_torque": 0.25, "armature": 2.0e-4, "spool_radius": 0.0125}
ACTUATORS = {"ideal": IDEAL, "pwm_servo": PWM, "pd_torque": TORQUE, "learned": LEARNED}
# A network takes a minute to be taught to the targets with a network of their own
SERVOS = [name for name in KINDS if name != "learned"]


def model_of(bench: str, actuator: str, *effects: str) -> Model:
    """Return a model of a bench with some effects at their typical numbers."""
    values: dict[str, Any] = dict(ACTUATORS[actuator])
    if bench in SHAFTS and actuator == "pwm_servo":
        values = dict(SHAFT)
    elif bench in SHAFTS:
        values["spool_radius"] = 1.0
    return stated_model(actuator, values, {name: TYPICAL[name] for name in effects})


def model_for(bench: str, servo: str) -> Model:
    """Return a servo with usual numbers."""
    if servo in ACTUATORS:
        return model_of(bench, servo)
    values = {p.name: p.nominal for p in find_actuator(servo).parameters}
    return stated_model(servo, values)


def short_run(bench: str, model: Model, rows: int = 60) -> Recording:
    """Return a step up, a step down and a ramp, inside the range of a bench."""
    mechanism = bench_of(bench, model)
    low, high = command_range(mechanism, spool_radius_of(model))
    index = np.arange(rows)
    share = np.where(index < 36, (index // 12) % 2, (index - 36) / 24)
    command = low + (high - low) * share
    return run_of(np.repeat(command[:, None], len(mechanism.tendons), axis=1), bench=bench)


def strays(
    folder: Path, target: str, way: str, bench: str, actuator: str, *effects: str
) -> Departure:
    """Return how far an exported model strays from our own simulation on a short run."""
    return strays_of(folder, target, way, bench, model_of(bench, actuator, *effects))


def strays_of(folder: Path, target: str, way: str, bench: str, model: Model) -> Departure:
    """Return the same of a model of one's own."""
    mechanism = bench_of(bench, model)
    run = short_run(bench, model)
    exported = EXPORTS[target].write(folder, mechanism, model)
    theirs = replayed(EXPORTS[target], exported, way, model, [run])
    plain = len(mechanism.tendons) == 1 and len(mechanism.joints) < 3
    # kernels of all effects compile once, those of a model's own for each model
    effects = tuple(EFFECTS) if model.effects and plain else None
    ours = rollout_of(mechanism, [run], model, candidates=Candidates(effects=effects))
    return departure(mechanism, theirs, ours.run(ours.base_vectors(model)[None])[0])
