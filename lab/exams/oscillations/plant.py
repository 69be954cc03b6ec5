"""Planted servo loops that shake, or do not: a plant that shares no law with what looks at them.

Motor and load are two masses on an elastic gear with play; friction is LuGre's; the duty is
limited. The loop closes in the servo (its command is the goal) or through a policy at the rows'
rate, whose commands are logged. Plain NumPy, all loops of an exam beside each other.
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP = 2.5e-4  # [s]
BRISTLE = 1e-3  # Travel in which friction builds up to 63 % [rad]
CAUSES = ("gain", "delay", "play", "sticking")


@dataclass(frozen=True, kw_only=True)
class Loops:
    """Loops beside each other, shape (N,) each."""

    outer: Array  # 1 where a policy closes the loop, 0 where the servo does
    servo_gain: Array  # Duty per error [1/rad]
    servo_integral: Array  # [1/(rad s)]
    strength: Array  # Acceleration of the bare motor at full duty [rad/s^2]
    damping: Array  # Back-EMF and oil [1/s]
    coulomb: Array  # [rad/s^2]
    static: Array  # [rad/s^2]
    slow: Array  # Stribeck's speed [rad/s]
    play: Array  # [rad]
    load: Array  # Share of the inertia behind the play [1]
    gear: Array  # Frequency of the gear [rad/s]
    delay: Array  # Age of what the servo acts on [s]
    gain: Array  # Of the policy: command per error [1]
    integral: Array  # Of the policy [1/s]
    row: Array  # Time between rows [s]
    spring: Array  # Of the load, beside the inertia of motor and load [1/s^2]
    rest: Array  # Where the spring's force is zero [rad]

    def but(self, **numbers: Array) -> "Loops":
        """Return loops with other numbers."""
        return replace(self, **numbers)

    def at(self, chosen: NDArray[np.intp]) -> "Loops":
        """Return some of the loops."""
        return Loops(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})


def run(
    loops: Loops, goal: Array, noise: Array, count: float = 2.0 * np.pi / 4096
) -> tuple[Array, Array, Array]:
    """Run loops; return commands, readings and true angles at every step of 1 ms [rad], (T, N).

    Args:
        goal: What is wanted, every millisecond [rad], shape (T, N).
        noise: What a reading is off, likewise.
        count: Resolution of the encoder [rad]; 0 is exact.
    """
    c, outer = loops, loops.outer > 0.0
    steps, number = goal.shape
    ticks = round(1e-3 / STEP)
    lateness = np.round(c.delay / 1e-3).astype(np.intp)
    every = np.maximum(1, np.round(c.row / 1e-3)).astype(np.intp)
    motor, speed, angle, rate, bristle, summed, wanted = np.zeros((7, number))
    motor, angle = goal[0].copy(), goal[0].copy()
    motor_mass, load_mass = 1.0 - c.load, c.load
    stiff = c.gear**2 * motor_mass * load_mass
    damper = 0.3 * c.gear * motor_mass * load_mass
    commands, readings, truth = np.empty((3, steps, number))
    acted = np.empty((steps, number))
    command, columns = goal[0].copy(), np.arange(number)
    for n in range(steps):
        read = angle + noise[n]
        if count:
            read = np.round(read / count) * count
        due = outer & (n % every == 0)
        error = goal[n] - read
        wanted = np.where(due, wanted + c.integral * c.row * error, wanted)
        command = np.where(due, goal[n] + c.gain * error + wanted, command)
        command = np.where(outer, np.clip(command, goal[n] - 0.5, goal[n] + 0.5), goal[n])
        # a policy's command travels; in a servo's own loop what it acts on is old
        acted[n] = np.where(outer, command, goal[n] - read)
        late = acted[np.maximum(n - lateness, 0), columns]
        error = np.where(outer, late - motor, late)
        summed = np.clip(summed + 1e-3 * c.servo_integral * error, -1.0, 1.0)
        duty = np.clip(c.servo_gain * error + summed, -1.0, 1.0)
        commands[n], readings[n], truth[n] = command, read, angle
        for _ in range(ticks):
            apart, sliding = motor - angle, speed - rate
            half = 0.5 * c.play
            beyond = apart - np.clip(apart, -half, half)
            torque = stiff * beyond + np.where(beyond != 0.0, damper * sliding, 0.0)
            torque = np.where(torque * beyond < 0.0, 0.0, torque)
            level = c.coulomb + (c.static - c.coulomb) * np.exp(-((speed / c.slow) ** 2))
            level = np.maximum(level, 1e-9)
            bristle += STEP * (speed - np.abs(speed) * bristle * c.static / (level * BRISTLE))
            bristle = np.clip(bristle, -BRISTLE, BRISTLE)
            drag = np.maximum(c.static, 1e-9) * bristle / BRISTLE
            push = c.strength * duty - c.damping * speed - drag - torque
            speed = speed + STEP * push / motor_mass
            held = 0.5 * rate * load_mass + c.spring * (angle - c.rest)
            rate = rate + STEP * (torque - held) / load_mass
            motor, angle = motor + STEP * speed, angle + STEP * rate
    return commands, readings, truth


def drawn(rng: np.random.Generator, cause: str, number: int) -> tuple[Loops, Loops]:
    """Draw loops with a cause, and the same ones without it; not each of them shakes.

    Numbers come from wide ranges, on a logarithmic scale.
    """

    def spread(low: float, high: float) -> Array:
        return np.exp(rng.uniform(np.log(low), np.log(high), number))

    outer = np.asarray(rng.random(number) < 0.5, dtype=np.float64)
    row = 1.0 / rng.choice([30.0, 50.0, 80.0, 100.0, 200.0], number)
    damping, top = spread(12.0, 60.0), spread(4.0, 14.0)
    pace = damping * spread(0.15, 0.45)  # How fast the sound loop is [1/s]
    strength = damping * top
    static = strength * spread(0.004, 0.02)
    sound = Loops(
        outer=outer,
        servo_gain=np.where(outer > 0.0, np.minimum(0.45 * damping, spread(6.0, 18.0)), pace) / top,
        servo_integral=np.zeros(number),
        strength=strength,
        damping=damping,
        coulomb=0.7 * static,
        static=static,
        slow=spread(0.05, 0.3),
        play=spread(5e-4, 2e-3),
        load=rng.uniform(0.1, 0.5, number),
        gear=2.0 * np.pi * spread(40.0, 80.0),
        delay=np.where(outer > 0.0, rng.uniform(0.0, 0.7, number) * row, spread(4e-3, 12e-3)),
        gain=outer * spread(0.2, 1.0),
        integral=outer * spread(0.05, 0.5),
        row=row,
        spring=np.zeros(number),
        rest=np.zeros(number),
    )
    inside = outer == 0.0
    if cause == "gain":
        factor = spread(4.0, 50.0)
        servo = np.where(inside, factor, 1.0) * sound.servo_gain
        return sound.but(servo_gain=servo, gain=sound.gain * factor), sound
    if cause == "delay":
        sound = sound.but(gain=outer * spread(1.0, 2.5))
        return sound.but(delay=sound.delay + spread(0.03, 0.25)), sound
    if cause == "play":
        servo = np.where(inside, spread(0.5, 3.0), 1.0) * sound.servo_gain
        sound = sound.but(servo_gain=servo, gain=outer * spread(1.0, 5.0))
        return sound.but(play=spread(0.02, 0.12)), sound
    integral = np.where(inside, sound.servo_gain * spread(1.0, 12.0), 0.0)
    sound = sound.but(servo_integral=integral, integral=outer * spread(1.0, 8.0))
    static = strength * sound.servo_gain * spread(0.02, 0.1)
    return sound.but(static=static, coulomb=static * rng.uniform(0.3, 0.7, number)), sound
