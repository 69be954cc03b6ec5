"""What the virtual bench does, against its sources: ``python -m lab.studies.virtual_bench``.

Ten units, driven by the real SDK as the paper drove its servo: PWM mode, position loop on the host
at 20 Hz, 10 % of duty per radian and 2 %. The ideal source F = max(0, P (theta_d - theta)) is
refitted on each unit's own runs and then closes the nominal finger in ``tendon_newton.simulation``.
"""

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_hardware.virtual_bench import BENCH_SEEDS, LockstepBench
from tendon_newton.data.excitations import excite
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.simulation.hosts.replay import bench_of
from tendon_newton.simulation.simulators import TendonSimulator

SERVO = "xc330_t288_t"
ROWS = 80  # [Hz]
HOST_DIVIDER = 4  # rows per command: 20 Hz
REACH = (-1.5, 2.0 * math.pi)  # [rad]; the sinusoid about 0.2 rad dips below zero
CENTRES = (0.2, 0.5 * math.pi)  # [rad]
"""Of the tip experiment. About 0.2 the ideal source opens the finger fully and closes it by 40 %,
far from self-contact; about pi/2 no command is negative."""
PAPER_GAIN = 4.2  # [N/rad]
HEADER = (
    "  unit P finger    P all   hysteresis finger, weak, strong   rise 10 %     50 %   holds at\n"
    "        [N/rad]  [N/rad]      [N]      [N]      [N]      [s]      [s]      [N]    [rad]"
)
UNIT_TIME = 60.0 + 60.0 + 60.0 + 4.0 + 5.0  # [s] of bench that a row of the table takes
SPOOL_RADIUS = 0.0125  # [m]
SETTLED = 2.0  # [s] one period of the sinusoid

Command = Callable[[float], float]


@dataclass(frozen=True, kw_only=True)
class Run:
    """Rows of one run; force and tip are the plant's own, so no sensor is in the figures."""

    time: Array
    command: Array
    position: Array
    force: Array
    tip: Array


def run(bench: str, seed: int, command: Command, duration: float) -> Run:
    """Drive one unit through a command [rad] of the time [s]."""
    twin = LockstepBench(bench, seed)
    clock = twin.clock
    servo = BusServo(SERVOS[SERVO], twin.servo_port(), clock=clock)
    servo.open()
    servo.configure()
    servo.enable_torque()
    loop = HostPositionLoop(position_range=REACH)
    start, rows, wanted = clock.now(), [], 0.0
    for k in range(round(duration * ROWS)):
        clock.sleep_until(start + k / ROWS)
        position = servo.read_state().position
        if k % HOST_DIVIDER == 0:
            wanted = command(k / ROWS)
            servo.command_duty(loop.duty(wanted, position))
        state = twin.state()
        rows.append((k / ROWS, wanted, position, state.tension, *(state.tip or (0.0, 0.0))))
    servo.close()
    table = np.array(rows).T
    return Run(time=table[0], command=table[1], position=table[2], force=table[3], tip=table[4:].T)


def shapes(seed: int) -> list[Command]:
    """Return the paper's shapes: a minute of random steps, a sinusoid and ramps."""
    rng = np.random.default_rng(seed)
    parts = [excite(name, 20.0, rng) for name in ("random_steps", "sine", "ramps")]
    times = [t for t, _ in parts]
    return [
        lambda t, k=k: float(np.interp(t, times[k], parts[k][1], right=parts[k][1][-1]))
        for k in range(3)
    ]


def fitted_gain(runs: list[Run]) -> float:
    """Return P by least squares of F on max(0, theta_d - theta) [N/rad]."""
    error = np.concatenate([np.clip(each.command - each.position, 0.0, None) for each in runs])
    force = np.concatenate([each.force for each in runs])
    return float(error @ force / (error @ error))


def slow_ramp(t: float) -> float:
    """Return a ramp to 3 rad and back at 0.3 rad/s."""
    return max(0.0, 3.0 - abs(0.3 * t - 3.0))


def hysteresis(each: Run) -> float:
    """Return the mean force on the way back less that on the way out at one command [N]."""
    out, back = each.time < 10.0, each.time >= 10.0
    grid = np.linspace(0.8, 2.4, 33)
    up = np.interp(grid, each.command[out], each.force[out])
    down = np.interp(grid, each.command[back][::-1], each.force[back][::-1])
    return float(np.mean(down - up))


def rise(each: Run, share: float) -> float:
    """Return when a step at 1 s has changed the force by a share of all that it does [s]."""
    before = each.force[each.time < 1.0][-1]
    after = each.force[each.time > 3.0].mean()
    late = (each.time >= 1.0) & (each.force >= before + share * (after - before))
    return float(each.time[late][0] - 1.0)


def closed_loop_tips(runs: list[Run], gains: list[float]) -> list[Array]:
    """Return the tip [m] of the nominal finger under the ideal source, shapes (T, 2)."""
    tips = []
    for each, gain in zip(runs, gains, strict=True):
        recording = Recording(
            name="sine",
            bench="finger",
            time=each.time,
            motor_position=each.position[:, None],
            motor_velocity=np.gradient(each.position, each.time)[:, None],
            command=each.command[:, None],
        )
        values = {"gain": gain, "spool_radius": SPOOL_RADIUS}
        model = Model(actuator=NamedValues(name="ideal", values=values))
        (trajectory,) = TendonSimulator().simulate([recording], model)
        finger = bench_of("finger", model)
        tips.append(
            np.array([tip_position(finger, row)[[0, 2]] for row in trajectory.joint_position])  # pyright: ignore
        )
    return tips


def tip_error(each: Run, tip: Array) -> float:
    """Return the RMS distance of the tips once the first period is over [mm]."""
    late = each.time >= SETTLED
    return 1e3 * float(np.sqrt(np.mean(np.sum((each.tip - tip)[late] ** 2, axis=1))))


def sine(centre: float) -> Command:
    """Return the tip experiment's command [rad] about a centre [rad]: pi/2 at 0.5 Hz."""
    return lambda t: centre + 0.5 * math.pi * math.sin(math.pi * t)


def measure(seed: int) -> list[float]:
    """Return a unit's row of the table."""
    fingers = [run("finger", seed, shape, 20.0) for shape in shapes(seed)]
    springs = [
        run(f"spring_{kind}", seed, shape, 10.0)
        for kind in ("weak", "strong")
        for shape in shapes(seed + 100)
    ]
    loops = [
        hysteresis(run(bench, seed, slow_ramp, 20.0))
        for bench in ("finger", "spring_weak", "spring_strong")
    ]
    step = run("finger", seed, lambda t: 0.5 if t < 1.0 else 4.0, 4.0)
    hold = run("finger", seed, lambda t: 2.6 if t < 2.0 else 1.0, 5.0)
    gains = [fitted_gain(fingers), fitted_gain(fingers + springs)]
    rises = [rise(step, 0.1), rise(step, 0.5)]
    return [*gains, *loops, *rises, float(hold.force[-1]), float(hold.position[-1])]


def print_tips(units: tuple[int, ...], gains: list[float], centre: float) -> None:
    """Print how far the ideal source misses the tip, by unit."""
    sines = [run("finger", seed, sine(centre), 12.0) for seed in units]
    for words, values in (("refitted", gains), ("4.2 N/rad", [PAPER_GAIN] * len(units))):
        tips = closed_loop_tips(sines, values)
        errors = [tip_error(each, tip) for each, tip in zip(sines, tips, strict=True)]
        row = " ".join(f"{error:5.1f}" for error in errors)
        print(
            f"tip about {centre:.2f} rad, P {words:10s} {row}   median {np.median(errors):.1f} mm"
        )


def main() -> None:
    """Measure the units and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=len(BENCH_SEEDS))
    units = BENCH_SEEDS[: parser.parse_args().units]
    quiet_warp()
    print(HEADER)
    table, began = [], time.monotonic()
    for seed in units:
        table.append(measure(seed))
        print(f"{seed:6d}" + "".join(f"{value:9.2f}" for value in table[-1]), flush=True)
    wall = time.monotonic() - began
    print("median" + "".join(f"{value:9.2f}" for value in np.median(table, axis=0)))
    print(f"{UNIT_TIME * len(units) / wall:.0f} times real time, SDK and driver included\n")
    for centre in CENTRES:
        print_tips(units, [row[1] for row in table], centre)


if __name__ == "__main__":
    main()
