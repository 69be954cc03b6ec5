"""Causes between the command and the load cell, drawn by seed."""

from collections.abc import Mapping

import numpy as np

from tests.planted.physics.causes import KNEE
from tests.planted.sets.planted import Draw, Planted, either_way, evenly, off, planted, single


def force_saturation(rng: np.random.Generator, size: float) -> Planted:
    """A motor that gives up at 7 to 11 N, over a knee."""
    limit = float(rng.uniform(7.0, 11.0)) / size**0.3
    return planted({"limit": limit, "knee": KNEE}, saturation=limit)


def speed_limit(rng: np.random.Generator, size: float) -> Planted:
    """A motor that turns at most at 4 to 9 rad/s."""
    return single("limit", "speed_limit", float(rng.uniform(4.0, 9.0)) / size**0.5)


def stribeck_friction(rng: np.random.Generator, size: float) -> Planted:
    """Dry friction of 0.5 to 0.9 N, 1.4 to 2 times that at rest, less within 1 to 3 rad/s."""
    coulomb = size * float(rng.uniform(0.5, 0.9))
    static = coulomb * float(rng.uniform(1.4, 2.0))
    speed = float(rng.uniform(1.0, 3.0))
    return planted(
        {"coulomb_force": coulomb, "static_force": static, "stribeck_velocity": speed},
        coulomb=coulomb,
        static=static - coulomb,
        stribeck_speed=speed,
    )


def torque_fade(rng: np.random.Generator, size: float) -> Planted:
    """A motor that loses a fifth to a half of 5 N, within 0.4 to 1.5 s."""
    fade, time = size * float(rng.uniform(0.01, 0.04)), float(rng.uniform(0.4, 1.5))
    return planted({"fade": fade, "time_constant": time}, fade=fade, fade_time=time)


def load_stribeck_friction(rng: np.random.Generator, size: float) -> Planted:
    """The same of 4 to 8 %, 1.5 to 2.5 times that at rest, less within 1 to 2.5 rad/s."""
    sliding = size * float(rng.uniform(0.04, 0.08))
    static = sliding * float(rng.uniform(1.5, 2.5))
    speed = float(rng.uniform(1.0, 2.5))
    return planted(
        {"coefficient": sliding, "static_coefficient": static, "stribeck_velocity": speed},
        gear_load=sliding,
        gear_static=static - sliding,
        stribeck_speed=speed,
    )


def command_rate_limit(rng: np.random.Generator, size: float) -> Planted:
    """A goal that moves at 4 to 9 rad/s at most."""
    return single("limit", "goal_rate", float(rng.uniform(4.0, 9.0)) / size**0.5)


def acceleration_limit(rng: np.random.Generator, size: float) -> Planted:
    """A goal that speeds up by 25 to 60 rad/s^2, to 8 to 14 rad/s."""
    limit, speed = float(rng.uniform(25.0, 60.0)) / size, float(rng.uniform(8.0, 14.0))
    return planted({"limit": limit, "speed": speed}, goal_acceleration=limit, goal_rate=speed)


def overload_cut(rng: np.random.Generator, size: float) -> Planted:
    """A servo that gives 12 to 18 % after 0.3 to 0.6 s at more than 25 to 30 %."""
    numbers = {
        "duty": float(rng.uniform(0.25, 0.30)),
        "fraction": float(rng.uniform(0.12, 0.18)) / size,
        "time": float(rng.uniform(0.3, 0.6)),
    }
    names = ("overload", "protective", "protection_time")
    return planted(numbers, **dict(zip(names, numbers.values(), strict=True)))


def asymmetric_friction(rng: np.random.Generator, size: float) -> Planted:
    """Dry friction of 0.4 to 0.7 N on the way in, two to three times that on the way out."""
    winding = size * float(rng.uniform(0.4, 0.7))
    unwinding = winding * float(rng.uniform(2.0, 3.0))
    values = {"winding": winding, "unwinding": unwinding}
    return planted(values, **values)


def hysteresis(rng: np.random.Generator, size: float) -> Planted:
    """Bristles of 0.7 to 1.5 N that bend by 0.3 to 1 mm."""
    force, travel = size * float(rng.uniform(0.7, 1.5)), float(rng.uniform(3e-4, 1e-3))
    return planted({"force": force, "travel": travel}, dahl=force, dahl_travel=travel)


def presliding(rng: np.random.Generator, _size: float) -> Planted:
    """Bristles of gear and guides that bend by 0.3 to 1 mm."""
    travel = float(rng.uniform(3e-4, 1e-3))
    return planted({"travel": travel}, bristle=travel, guide_bristle=travel)


ACTUATOR: Mapping[str, Draw] = {
    # A servo 12 to 30 % too soft or too hard
    "gain_error": off("scale", "gain_scale", 0.12, 0.30),
    # A gain that falls or rises by 0.6 to 1.5 % a second
    "gain_drift": either_way("rate", "gain_drift", 0.006, 0.015),
    # A command 15 to 45 ms late
    "command_delay": evenly("delay", "delay", 0.015, 0.045),
    # A motor force with a time constant of 15 to 80 ms
    "actuator_lag": evenly("time_constant", "lag", 0.015, 0.08),
    # A servo that leaves errors of 0.06 to 0.25 rad
    "deadband": evenly("width", "deadband", 0.06, 0.25),
    "force_saturation": force_saturation,
    "speed_limit": speed_limit,
    # Dry friction of 0.7 to 1.5 N
    "coulomb_friction": evenly("force", "coulomb", 0.7, 1.5),
    "stribeck_friction": stribeck_friction,
    # Viscous friction of 0.8 to 1.8 N s/rad
    "viscous_friction": evenly("coefficient", "viscous", 0.8, 1.8),
    # Dry friction of 8 to 20 % of the tension
    "load_dependent_friction": evenly("coefficient", "load", 0.08, 0.20),
    # Dry friction of 5 to 12 % of what motor and load press its teeth with
    "gear_load_friction": evenly("coefficient", "gear_load", 0.05, 0.12),
    "load_stribeck_friction": load_stribeck_friction,
    # A gear that keeps 15 to 35 % of a load that turns it backwards
    "holding_friction": evenly("share", "holding", 0.15, 0.35),
    # A supply that gives way by 2 to 6 % per newton of motor force
    "voltage_sag": evenly("sag", "sag", 0.02, 0.06),
    "torque_fade": torque_fade,
    "command_rate_limit": command_rate_limit,
    "acceleration_limit": acceleration_limit,
    # A servo that adds 2 to 5 % of its force to any demand
    "starting_duty": evenly("duty", "starting_duty", 0.02, 0.05),
    "overload_cut": overload_cut,
    "asymmetric_friction": asymmetric_friction,
    "hysteresis": hysteresis,
    "presliding": presliding,
}
