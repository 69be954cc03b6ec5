"""Causes that no effect of the catalogue describes: naming one for them is an error."""

from collections.abc import Mapping

import numpy as np

from tests.planted.sets.planted import Draw, Planted, evenly, planted


def periodic_cogging(rng: np.random.Generator, size: float) -> Planted:
    """A ripple of the motor force of 0.4 to 0.8 N, 6 to 12 times a turn."""
    amplitude, phase = size * float(rng.uniform(0.4, 0.8)), float(rng.uniform(0.0, 2.0 * np.pi))
    rate = float(rng.uniform(6.0, 12.0))
    return planted(
        {"amplitude": amplitude, "per_radian": rate, "phase": phase},
        cogging=amplitude,
        cogging_rate=rate,
        cogging_phase=phase,
    )


def hand_knocks(rng: np.random.Generator, size: float) -> Planted:
    """Pushes of about 4 to 7 N, about once a second."""
    peak, rate = size * float(rng.uniform(4.0, 7.0)), float(rng.uniform(0.7, 1.2))
    return planted({"peak": peak, "per_second": rate}, knock_peak=peak, knock_rate=rate)


def dead_spot(rng: np.random.Generator, size: float) -> Planted:
    """Half to nine tenths of the force lost within 0.1 to 0.2 rad of an angle of 0.5 to 1 rad."""
    depth = size * float(rng.uniform(0.5, 0.9))
    at, width = float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.1, 0.2))
    return planted(
        {"depth": depth, "angle": at, "width": width},
        dead_spot=depth,
        dead_spot_at=at,
        dead_spot_width=width,
    )


def swinging_mount(rng: np.random.Generator, size: float) -> Planted:
    """A servo that swings on its mount at 3 to 6 Hz and gives 0.15 to 0.3 mm per newton."""
    give, pace = size * float(rng.uniform(1.5e-4, 3e-4)), float(rng.uniform(3.0, 6.0))
    return planted(
        {"compliance": give, "frequency": pace},
        mount_compliance=give,
        mount_rate=2.0 * np.pi * pace,
    )


OUTSIDE: Mapping[str, Draw] = {
    "periodic_cogging": periodic_cogging,
    # A servo that hears its command in steps of 0.1 to 0.25 rad
    "command_quantisation": evenly("lsb", "command_step", 0.1, 0.25),
    "hand_knocks": hand_knocks,
    # A gain that wanders by 8 to 15 % about its right value
    "wandering_gain": evenly("deviation", "gain_wander", 0.08, 0.15),
    # Dry friction that comes and goes, 1.2 to 2 N at its most
    "swaying_friction": evenly("greatest", "friction_sway", 1.2, 2.0),
    # A log in which angle and speed repeat themselves for 0.1 to 0.5 s, about once a second
    "stuck_encoder": evenly("per_second", "stuck_rate", 0.6, 1.2),
    "dead_spot": dead_spot,
    # Commands that take effect at once or up to 60 to 120 ms late, each its own time
    "command_jitter": evenly("greatest", "jitter", 0.06, 0.12),
    "swinging_mount": swinging_mount,
}

NEAR: Mapping[str, tuple[str, ...]] = {
    # its mean is a dry friction, and only how it changes is beyond the catalogue
    "swaying_friction": ("coulomb_friction", "stribeck_friction", "load_dependent_friction"),
    # its mean is a delay; commands in a queue come smeared, as through a lag
    "command_jitter": ("command_delay", "actuator_lag"),
    # pulled slowly it is a tendon that stretches, and all that looks like one
    "swinging_mount": ("tendon_compliance", "spool_radius_error", "joint_stiffness_error"),
}
"""Effects that imitate a cause so well that naming them is no mistake; for all others none."""
