"""From a position error to the motor's force."""

import warp as wp

from tendon_newton.device_code.placeholders import HAS_DUTY, Jet, ParameterVector, real
from tendon_newton.device_code.slots import (
    actuator_force,
    angle_effects,
    asked_duty,
    driven_force,
    duty_effects,
    error_effects,
    motor_force_effects,
    stretch_effects,
)
from tendon_newton.device_code.structs import Flow, Tendon
from tendon_newton.device_code.templates import device_template

# Force [N] that no mechanism overcomes: what a motor at its greatest speed holds against
HELD = 1.0e6


@device_template
def clip(signal: Jet, lower: real, upper: real) -> Jet:
    """Limit a jet; beyond a bound its derivatives vanish."""
    out = signal
    if signal[0] < lower:
        out = Jet(lower, real(0.0), real(0.0))
    if signal[0] > upper:
        out = Jet(upper, real(0.0), real(0.0))
    return out


@device_template
def on_side(tendon: Tendon, side: real) -> Tendon:
    """Return a tendon that slides on a side."""
    out = tendon
    out.side = side
    out.direction = wp.clamp(side, real(-1.0), real(1.0))
    return out


@device_template
def is_outrun(tendon: Tendon) -> bool:
    """Tell whether a tendon is beyond its motor's greatest speed."""
    return tendon.side * tendon.direction > real(1.5)


@device_template
def holding_force(tendon: Tendon) -> Jet:
    """Return what such a motor holds against the motion with [N]."""
    return Jet(-real(HELD) * tendon.direction, real(0.0), real(0.0))


@device_template
def servo_flow(tendon: Tendon, p: ParameterVector) -> Flow:
    """Follow the signal from the encoder to the motor's force."""
    limit = tendon.force_limit
    length = stretch_effects(Jet(tendon.wound, real(1.0), real(0.0)), tendon, p)
    flow = Flow()
    flow.angle = angle_effects(length * tendon.inverse_radius, tendon, p)
    error = Jet(tendon.command, real(0.0), real(0.0)) - flow.angle
    acting = tendon
    acting.error = error[0]
    flow.error = error_effects(error, acting, p)
    if wp.static(HAS_DUTY):
        acting.force_limit = wp.min(limit, real(HELD))
        flow.duty = duty_effects(asked_duty(flow.error, acting, p), acting, p)
        force = clip(driven_force(flow.duty, acting, p), -limit, limit)
    else:
        force = clip(actuator_force(flow.error, acting, p), -limit, limit)
    flow.motor_force = motor_force_effects(force * tendon.enabled, acting, p)
    return flow


@device_template
def duty_of_force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return the share of its limit that a servo's force would be [1]."""
    limit = tendon.force_limit
    return clip(actuator_force(error, tendon, p), -limit, limit) * (real(1.0) / limit)


@device_template
def force_of_duty(duty: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return the force [N] that is a share of a servo's limit."""
    return duty * tendon.force_limit
