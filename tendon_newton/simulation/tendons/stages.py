"""Templates of the stages: each applies the effects of one stage, or lets them remember."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    BITS,
    FUNCTIONS,
    MEMORIES,
    OFFSETS,
    PLACES,
    SECOND_MEMORIES,
    SKIPS,
    STRIDES,
    Flags,
    Jet,
    MemoryVector,
    Owner,
    ParameterVector,
    Values,
    real,
)
from tendon_newton.device_code.structs import Joint
from tendon_newton.device_code.templates import device_template


@device_template
def own_values(p: ParameterVector, offset: int, remembered: real, second: real) -> Values:
    """Return what is an effect's own; the parameter vector ends in two zeros of padding."""
    return Values(p[offset], p[offset + 1], p[offset + 2], remembered, second)


@device_template
def is_awake(asleep: Flags, bit: int) -> bool:
    """Tell whether an effect has a parameter that is not null; on a tape, every one counts."""
    if wp.static(SKIPS):
        return (asleep >> Flags(bit)) & Flags(1) == Flags(0)
    return True


@device_template
def any_awake(asleep: Flags) -> bool:
    """Tell whether any effect of a stage is awake."""
    if wp.static(SKIPS):
        every = Flags(wp.static(sum(1 << bit for bit in set(BITS))))
        return asleep & every != every
    return True


@device_template
def scalar_stage(signal: real, p: ParameterVector) -> real:
    """Apply effects to a number that neither position nor speed decides."""
    for i in range(wp.static(len(FUNCTIONS))):
        values = own_values(p, wp.static(OFFSETS[i]), real(0.0), real(0.0))
        signal = wp.static(FUNCTIONS[i])(signal, values)
    return signal


@device_template
def tendon_number_stage(signal: real, d: int, p: ParameterVector) -> real:
    """Apply effects to a number of tendon d that neither position nor speed decides."""
    for i in range(wp.static(len(FUNCTIONS))):
        place = wp.static(OFFSETS[i])
        if wp.static(STRIDES[i] > 0):  # else a constant, so that numbers stay in registers
            place = wp.static(OFFSETS[i]) + wp.static(STRIDES[i]) * d
        values = own_values(p, place, real(0.0), real(0.0))
        signal = wp.static(FUNCTIONS[i])(signal, values)
    return signal


@device_template
def timed_stage(signal: real, time: real, d: int, p: ParameterVector) -> real:
    """Apply effects to a number of tendon d at an instant [s]."""
    for i in range(wp.static(len(FUNCTIONS))):
        place = wp.static(OFFSETS[i])
        if wp.static(STRIDES[i] > 0):  # else a constant, so that numbers stay in registers
            place = wp.static(OFFSETS[i]) + wp.static(STRIDES[i]) * d
        values = own_values(p, place, real(0.0), real(0.0))
        signal = wp.static(FUNCTIONS[i])(signal, time, values)
    return signal


@device_template
def joint_number_stage(signal: real, joint: Joint, p: ParameterVector) -> real:
    """Apply effects to a number of one joint."""
    for i in range(wp.static(len(FUNCTIONS))):
        values = own_values(p, wp.static(OFFSETS[i]), real(0.0), real(0.0))
        signal = wp.static(FUNCTIONS[i])(signal, joint, values)
    return signal


@device_template
def signal_stage(signal: Jet, owner: Owner, p: ParameterVector) -> Jet:
    """Apply effects to a signal of one tendon or a torque of one joint."""
    if any_awake(owner.asleep):
        for i in range(wp.static(len(FUNCTIONS))):
            remembered = real(0.0)
            if wp.static(MEMORIES[i] >= 0):
                remembered = owner.memory[wp.static(MEMORIES[i]) + owner.index]
            second = real(0.0)
            if wp.static(SECOND_MEMORIES[i] >= 0):
                second = owner.memory[wp.static(SECOND_MEMORIES[i]) + owner.index]
            place = wp.static(OFFSETS[i])
            if wp.static(STRIDES[i] > 0):  # else a constant, so that numbers stay in registers
                place = wp.static(OFFSETS[i]) + wp.static(STRIDES[i]) * owner.index
            values = own_values(p, place, remembered, second)
            if is_awake(owner.asleep, wp.static(BITS[i])):
                signal = wp.static(FUNCTIONS[i])(signal, owner, values)
    return signal


@device_template
def signal_memory(
    signal: Jet, owner: Owner, p: ParameterVector, memory: MemoryVector
) -> MemoryVector:
    """Renew what effects remember of one tendon or joint."""
    out = memory
    if any_awake(owner.asleep):
        for i in range(wp.static(len(FUNCTIONS))):
            remembered = owner.memory[wp.static(MEMORIES[i]) + owner.index]
            second = real(0.0)
            if wp.static(SECOND_MEMORIES[i] >= 0):
                second = owner.memory[wp.static(SECOND_MEMORIES[i]) + owner.index]
            place = wp.static(OFFSETS[i])
            if wp.static(STRIDES[i] > 0):  # else a constant, so that numbers stay in registers
                place = wp.static(OFFSETS[i]) + wp.static(STRIDES[i]) * owner.index
            values = own_values(p, place, remembered, second)
            if is_awake(owner.asleep, wp.static(BITS[i])):
                own = wp.static(FUNCTIONS[i])(signal, owner, values)
                out[wp.static(PLACES[i]) + owner.index] = own
    return out
