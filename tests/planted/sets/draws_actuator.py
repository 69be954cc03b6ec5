"""Causes between the command and the load cell, drawn by seed."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tests.planted.physics.causes import KNEE
from tests.planted.sets.planted import Draw, Planted, either, planted, scale, single


def gain_error(rng: np.random.Generator, size: float) -> Planted:
    """A servo 12 to 30 % too soft or too hard."""
    return single("scale", "gain_scale", scale(rng, 0.12, 0.30, size))


def gain_drift(rng: np.random.Generator, size: float) -> Planted:
    """A gain that falls or rises by 0.6 to 1.5 % a second."""
    return single("rate", "gain_drift", size * either(rng, 0.006, 0.015))


def command_delay(rng: np.random.Generator, size: float) -> Planted:
    """A command 15 to 45 ms late."""
    return single("delay", "delay", size * float(rng.uniform(0.015, 0.045)))


def actuator_lag(rng: np.random.Generator, size: float) -> Planted:
    """A motor force with a time constant of 15 to 80 ms."""
    return single("time_constant", "lag", size * float(rng.uniform(0.015, 0.08)))


def deadband(rng: np.random.Generator, size: float) -> Planted:
    """A servo that leaves errors of 0.06 to 0.25 rad."""
    return single("width", "deadband", size * float(rng.uniform(0.06, 0.25)))


def force_saturation(rng: np.random.Generator, size: float) -> Planted:
    """A motor that gives up at 7 to 11 N, over a knee."""
    limit = float(rng.uniform(7.0, 11.0)) / size**0.3
    return planted({"limit": limit, "knee": KNEE}, saturation=limit)


def speed_limit(rng: np.random.Generator, size: float) -> Planted:
    """A motor that turns at most at 4 to 9 rad/s."""
    return single("limit", "speed_limit", float(rng.uniform(4.0, 9.0)) / size**0.5)


def coulomb_friction(rng: np.random.Generator, size: float) -> Planted:
    """Dry friction of 0.7 to 1.5 N."""
    return single("force", "coulomb", size * float(rng.uniform(0.7, 1.5)))


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


def viscous_friction(rng: np.random.Generator, size: float) -> Planted:
    """Viscous friction of 0.8 to 1.8 N s/rad."""
    return single("coefficient", "viscous", size * float(rng.uniform(0.8, 1.8)))


def load_dependent_friction(rng: np.random.Generator, size: float) -> Planted:
    """Dry friction of 8 to 20 % of the tension."""
    return single("coefficient", "load", size * float(rng.uniform(0.08, 0.20)))


def voltage_sag(rng: np.random.Generator, size: float) -> Planted:
    """A supply that gives way by 2 to 6 % per newton of motor force."""
    return single("sag", "sag", size * float(rng.uniform(0.02, 0.06)))


def torque_fade(rng: np.random.Generator, size: float) -> Planted:
    """A motor that loses a fifth to a half of 5 N, within 0.4 to 1.5 s."""
    fade, time = size * float(rng.uniform(0.01, 0.04)), float(rng.uniform(0.4, 1.5))
    return planted({"fade": fade, "time_constant": time}, fade=fade, fade_time=time)


def holding_friction(rng: np.random.Generator, size: float) -> Planted:
    """A gear that keeps 15 to 35 % of a load that turns it backwards."""
    return single("share", "holding", size * float(rng.uniform(0.15, 0.35)))


def gear_load_friction(rng: np.random.Generator, size: float) -> Planted:
    """Dry friction of 5 to 12 % of what motor and load press its teeth with."""
    return single("coefficient", "gear_load", size * float(rng.uniform(0.05, 0.12)))


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


def starting_duty(rng: np.random.Generator, size: float) -> Planted:
    """A servo that adds 2 to 5 % of its force to any demand."""
    return single("duty", "starting_duty", size * float(rng.uniform(0.02, 0.05)))


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


ACTUATOR: Mapping[str, Draw] = MappingProxyType(
    {
        "gain_error": gain_error,
        "gain_drift": gain_drift,
        "command_delay": command_delay,
        "actuator_lag": actuator_lag,
        "deadband": deadband,
        "force_saturation": force_saturation,
        "speed_limit": speed_limit,
        "coulomb_friction": coulomb_friction,
        "stribeck_friction": stribeck_friction,
        "viscous_friction": viscous_friction,
        "load_dependent_friction": load_dependent_friction,
        "gear_load_friction": gear_load_friction,
        "load_stribeck_friction": load_stribeck_friction,
        "holding_friction": holding_friction,
        "voltage_sag": voltage_sag,
        "torque_fade": torque_fade,
        "command_rate_limit": command_rate_limit,
        "acceleration_limit": acceleration_limit,
        "starting_duty": starting_duty,
        "overload_cut": overload_cut,
        "asymmetric_friction": asymmetric_friction,
        "hysteresis": hysteresis,
    }
)
