"""The compiled twin of a perceptron or a recurrent network: one thread takes a few servos through.

A thread's servos are lanes of a vector, as in `twin_kernels`. Four units are summed side by side,
so that a processor need not wait for one sum to take its next term; their weights stand
interleaved.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.actuators.networks.twin_kernels import plain
from tendon_newton.device_code.placeholders import DeviceArray, Placeholder
from tendon_newton.device_code.templates import device_template

Lane = Placeholder
"""One number per servo of a thread."""
Units = Placeholder
"""WIDEST lanes: what goes into a layer or comes out of it."""
Ring = Placeholder
LANES = 1
WINDOW = 30
HIDDEN = 3
"""Layers before the last one."""
TANH = False
"""Whether the activation is the hyperbolic tangent; else it is the positive part."""
TANH_END = wp.constant(9.0)
"""Beyond it the hyperbolic tangent is one in single precision."""


@device_template
def activated(x: Lane) -> Lane:
    """Return the activation of each lane."""
    out = Lane()
    for lane in range(LANES):
        if wp.static(TANH):
            # through one exponential: a library's own tanh branches, and takes twice as long
            bounded = wp.clamp(x[lane], -TANH_END, TANH_END)
            out[lane] = wp.float32(1.0) - wp.float32(2.0) / (
                wp.exp(wp.float32(2.0) * bounded) + wp.float32(1.0)
            )
        else:
            out[lane] = wp.max(x[lane], wp.float32(0.0))
    return out


@device_template
def layer(w: DeviceArray[wp.float32], at: int, inputs: int, units: int, x: Units) -> Units:
    """Return a layer's units: their four biases, then the weights of each input, four by four."""
    out = Units()
    place = at
    for first in range(0, units, 4):
        a = plain(w[place])
        b = plain(w[place + 1])
        c = plain(w[place + 2])
        d = plain(w[place + 3])
        for k in range(inputs):
            place = place + 4
            value = x[k]
            a = a + value * w[place]
            b = b + value * w[place + 1]
            c = c + value * w[place + 2]
            d = d + value * w[place + 3]
        place = place + 4
        out[first] = activated(a)
        out[first + 1] = activated(b)
        out[first + 2] = activated(c)
        out[first + 3] = activated(d)
    return out


@device_template
def write_force(
    w: DeviceArray[wp.float32],
    at: int,
    inputs: int,
    x: Units,
    group: int,
    count: int,
    limit: wp.float32,
    force: DeviceArray[wp.float32],
) -> None:
    """Write the forces [N] that the last layer, one unit, makes of its inputs."""
    answer = plain(w[at])
    for k in range(inputs):
        answer = answer + x[k] * w[at + 1 + k]
    for lane in range(LANES):
        servo = group * LANES + lane
        if servo < count:
            force[servo] = wp.min(answer[lane], limit)


@device_template
def perceptron_kernel(
    ring: Ring,
    newest: DeviceArray[int],
    count: int,
    w: DeviceArray[wp.float32],
    layout: DeviceArray[int],
    limit: wp.float32,
    force: DeviceArray[wp.float32],
) -> None:
    """Write the forces [N] of one group; `layout` has place, inputs and units of each layer."""
    group = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    x = Units()
    for lane in range(LANES):
        servo = wp.min(group * LANES + lane, count - 1)
        oldest = newest[servo] + 1
        for k in range(WINDOW):
            place = (oldest + k) % WINDOW
            for c in range(3):
                x[3 * k + c, lane] = ring[place, c, servo]
    for hidden in range(HIDDEN):
        x = layer(w, layout[3 * hidden], layout[3 * hidden + 1], layout[3 * hidden + 2], x)
    write_force(w, layout[3 * HIDDEN], layout[3 * HIDDEN + 1], x, group, count, limit, force)


@device_template
def recurrent_kernel(
    ring: Ring,
    newest: DeviceArray[int],
    count: int,
    w: DeviceArray[wp.float32],
    layout: DeviceArray[int],
    limit: wp.float32,
    force: DeviceArray[wp.float32],
) -> None:
    """Write the forces [N] of one group of servos; a layer's inputs are its state and a sample."""
    group = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    inputs = layout[1]
    x = Units()
    for k in range(WINDOW):
        for lane in range(LANES):
            servo = wp.min(group * LANES + lane, count - 1)
            place = (newest[servo] + 1 + k) % WINDOW
            for c in range(3):
                x[inputs - 3 + c, lane] = ring[place, c, servo]
        x = layer(w, layout[0], inputs, layout[2], x)
    write_force(w, layout[3], layout[4], x, group, count, limit, force)
