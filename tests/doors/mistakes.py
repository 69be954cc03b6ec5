"""The table of mistakes in columns: what was done to a sound log, and what is said about it.

Each is made in two runs. Those of files and mappings are in `tests.doors.files`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from tests.doors.logs import (
    RATE,
    ROWS,
    Array,
    Columns,
    Door,
    csv_logs,
    followed,
    lerobot,
    lone,
    own_dataset,
)

Spoil = Callable[[Columns], object]
TURN = 2.0 * np.pi
CSV, OWN, LEROBOT = "import mapped", "doctor, our format", "doctor, LeRobot"
OURS: dict[str, Door] = {CSV: csv_logs(), OWN: own_dataset}
ALONE: dict[str, Door] = {LEROBOT: lambda folder, runs: lerobot(folder, runs[:1])}
DOORS = {**OURS, **ALONE}
PATH = '\n[model]\nkind = "measured_path"\n'
LED: dict[str, Door] = {
    CSV: csv_logs("pendulum", mapping=lambda text: text + PATH),
    OWN: partial(own_dataset, bench="pendulum"),
}
FAILED = np.arange(40, ROWS, 37)
"""Rows in which a bus read nothing."""
OFTEN = np.flatnonzero(np.random.default_rng(7).random(ROWS) < 0.2)
"""The same of a bad bus."""


@dataclass(frozen=True, kw_only=True)
class Mistake:
    """One mistake, and what is said about it."""

    name: str
    said: str  # Words of the line that says what to do
    spoil: Spoil = lambda run: None
    doors: dict[str, Door] = field(default_factory=lambda: DOORS)
    thread: str = ""  # Public report of the kind


def put(name: str, rows: Array | slice, value: float) -> Spoil:
    """Return a change of some rows of a column to a number."""
    return lambda run: run[name].__setitem__(rows, value)


def made(name: str, law: Callable[[Columns], Array]) -> Spoil:
    """Return a change of a whole column."""
    return lambda run: run.__setitem__(name, law(run))


def again(run: Columns) -> None:
    """Repeat the last reading in every fourth row."""
    rows = np.arange(4, ROWS, 4)
    run["q_0"][rows] = run["q_0"][rows - 1]


def neighbours(run: Columns) -> None:
    """Read the other joint."""
    run["q_0"][FAILED] = run["q_1"][FAILED]


def swung(run: Columns) -> None:
    """Let a joint swing three times a second."""
    run["goal_0"] = np.sin(3.0 * TURN * run["t"])
    run["q_0"] = followed(run["goal_0"])


def stepped(run: Columns) -> None:
    """Answer each step over a tenth of a second, and write the answers as commands."""
    for joint in ("0", "1"):
        held = np.repeat(run[f"goal_{joint}"][::60], 60)
        run |= {f"q_{joint}": held, f"goal_{joint}": followed(held, lag=8.0)}


def rested(run: Columns) -> None:
    """Let one joint stay where it is."""
    run["goal_0"][:] = run["q_0"][:] = 0.5


def away(run: Columns) -> None:
    """Let a joint go about another place than its zero."""
    run["goal_0"], run["q_0"] = run["goal_0"] + 0.5, run["q_0"] + 0.5


def frozen(run: Columns) -> None:
    """Read one angle for 300 rows."""
    run["q_0"][400:700] = run["q_0"][400]


def stalled(run: Columns) -> None:
    """Write one row for 100 rows."""
    for name in set(run) - {"t"}:
        run[name][400:500] = run[name][400]


def all_frozen(run: Columns) -> None:
    """Read one angle of every joint for 100 rows."""
    for name in ("q_0", "q_1"):
        run[name][400:500] = run[name][400]


def led(run: Columns) -> None:
    """Log a joint's torque in the place of its command: weight, friction and noise."""
    lone(run)
    del run["goal"]
    run["force"] = 0.5 * np.sin(run["q"]) + 0.1 * np.sign(np.gradient(run["q"]))
    run["force"] += np.random.default_rng(2).normal(0.0, 0.01, ROWS)


def led_with(spoil: Spoil) -> Spoil:
    """Return a change of such a log."""
    return lambda run: (led(run), spoil(run))


def halfway(run: Columns) -> None:
    """Let a seam lie at half a turn, in the middle of the way."""
    run["goal_0"] = run["goal_0"] + 3.1
    run["q_0"] = np.mod(run["q_0"] + 3.1 + np.pi, TURN) - np.pi


def exchanged(run: Columns) -> None:
    """Exchange two joints' angles."""
    run["q_0"], run["q_1"] = run["q_1"], run["q_0"]


def swapped(run: Columns) -> None:
    """Exchange angle and command of a joint."""
    run["goal_0"], run["q_0"] = run["q_0"], run["goal_0"]


def still(run: Columns) -> None:
    """Let nothing move."""
    run |= {name: np.full(ROWS, 0.5) for name in run if name != "t"}


def noisy_rest(run: Columns) -> None:
    """Let nothing move but the encoder, by half a count to either side."""
    still(run)
    run["q_0"] = 0.5 + np.random.default_rng(1).integers(0, 2, ROWS) * TURN / 4096.0


def cut(run: Columns) -> None:
    """Keep a tenth of a second."""
    for name in run:
        run[name] = run[name][:8]


def restarted(run: Columns) -> None:
    """Let the clock begin again in the middle."""
    run["t"][ROWS // 2 :] -= run["t"][ROWS // 2]


def doubled(run: Columns) -> None:
    """Stamp two rows alike, often."""
    run["t"] = np.repeat(run["t"][::2], 2)


def shuffled(run: Columns) -> None:
    """Write rows out of order."""
    order = np.random.default_rng(1).permutation(ROWS)
    for name in run:
        run[name] = run[name][order]


def overtaken(run: Columns) -> None:
    """Write some rows before the one that came first."""
    for row in range(50, ROWS - 50, 100):
        for name in run:
            run[name][[row, row + 1]] = run[name][[row + 1, row]]


def off(run: Columns) -> None:
    """Switch the motor off for the second half, and let the joint fall."""
    for name in ("q_0", "q_1"):
        run[name][ROWS // 2 :] = -0.9


def pause(run: Columns) -> None:
    """Log nothing for three seconds."""
    run["t"][ROWS // 2 :] += 3.0


def register(counts: Array, bits: int, *, sized: bool) -> Array:
    """Return what an unsigned register shows of signed counts."""
    below = np.abs(counts) if sized else counts
    return np.where(counts < 0.0, below + 2.0**bits, counts)


def load(run: Columns) -> Array:
    """Return the load of a servo in counts of a thousandth."""
    return np.round(2000.0 * (run["goal_0"] - run["q_0"]))


def speed(run: Columns) -> Array:
    """Return the speed of a joint [rad/s]."""
    return RATE * np.gradient(run["q_0"])


def speeds(factor: float) -> Spoil:
    """Return logged speeds in another unit."""
    return lambda run: run.update(
        {f"speed_{k}": factor * RATE * np.gradient(run[f"q_{k}"]) for k in range(2)}
    )


def read_slowly(run: Columns, *, lines: bool) -> None:
    """Read every tenth of a second, and write the last angle or a straight line between."""
    fresh = np.arange(0, ROWS, 8)
    run["q_0"] = (
        np.interp(np.arange(ROWS), fresh, run["q_0"][fresh])
        if lines
        else np.repeat(run["q_0"][fresh], 8)
    )


ANGLES: tuple[Mistake, ...] = (
    Mistake(name="read slower than it is logged", said="log a row where it is read",
        spoil=lambda run: read_slowly(run, lines=False)),
    Mistake(name="lines between slow readings", said="log a row where it is read",
        spoil=lambda run: read_slowly(run, lines=True)),
    Mistake(name="whole degrees", said="log more of its digits",
        spoil=made("q_0", lambda run: np.deg2rad(np.round(np.rad2deg(run["q_0"]))))),
    Mistake(name="twice the angle", said="or the other side of a gear",
        spoil=made("q_0", lambda run: 2.0 * run["q_0"])),
    Mistake(name="an angle two seconds late", said="put both on one clock",
        spoil=made("q_0", lambda run: np.r_[np.full(160, run["q_0"][0]), run["q_0"][:-160]])),
    Mistake(name="an angle half a second ahead", said="put both on one clock",
        spoil=made("q_0", lambda run: np.r_[run["q_0"][40:], np.full(40, run["q_0"][-1])])),
    Mistake(name="zeros where the bus read nothing", spoil=put("q_0", FAILED, 0.0),
        said="leave those rows out", thread="ROBOTIS-GIT/DynamixelSDK#256"),
    Mistake(name="a constant where the bus read nothing", spoil=put("q_0", FAILED, 3.1),
        said="leave those rows out"),
    Mistake(name="zeros in every fifth row", spoil=put("q_0", OFTEN, 0.0),
        said="leave those rows out", thread="ROBOTIS-GIT/DynamixelSDK#256"),
    Mistake(name="a constant in every fifth row", spoil=put("q_0", OFTEN, 3.1),
        said="leave those rows out"),
    Mistake(name="a neighbour's angle in every fifth row", said="leave those rows out",
        spoil=lambda run: put("q_0", OFTEN, run["q_1"][OFTEN])(run)),
    Mistake(name="zeros amid a fast swing", said="leave those rows out",
        spoil=lambda run: (swung(run), put("q_0", FAILED, 0.0)(run))),
    Mistake(name="zeros of a joint that rests", said="leave those rows out",
        spoil=lambda run: (rested(run), put("q_0", FAILED, 0.0)(run))),
    Mistake(name="a neighbour's angle", spoil=neighbours,
        said="leave those rows out", thread="ROBOTIS-GIT/DynamixelSDK#256"),
    Mistake(name="one row far off", spoil=put("q_0", slice(300, 301), 2.0),
        said="leave those rows out"),
    Mistake(name="the last reading again", spoil=again, said="was not read anew there"),
    Mistake(name="300 rows frozen", spoil=frozen, said="the reading froze",
        thread="huggingface/lerobot#3280"),
    Mistake(name="a joint reversed", spoil=made("q_0", lambda run: -run["q_0"]),
        said="turn the sign of one", thread="huggingface/lerobot#930"),
    Mistake(name="the encoder's seam inside the range", said="add the turns",
        spoil=made("q_0", lambda run: np.mod(run["q_0"], TURN))),
    Mistake(name="the seam in angle and command", said="add the turns",
        spoil=lambda run: run.update({n: np.mod(run[n], TURN) for n in ("q_0", "goal_0")})),
    Mistake(name="an angle in degrees", said='say unit = "deg" for it', doors=OURS,
        spoil=made("q_0", lambda run: np.rad2deg(run["q_0"]))),
    Mistake(name="an angle in degrees, the action in rad", said="write both in one unit",
        spoil=made("q_0", lambda run: np.rad2deg(run["q_0"])), doors=ALONE),
    Mistake(name="an angle through a gear", spoil=made("q_0", lambda run: 0.1 * run["q_0"]),
        said="or the other side of a gear"),
    Mistake(name="an angle that never changes", said="or this is no reading of it",
        spoil=made("q_0", lambda run: np.full(ROWS, 0.3))),
    Mistake(name="thirty rows of zeros", spoil=put("q_0", slice(400, 430), 0.0),
        said="leave those rows out"),
    Mistake(name="ten rows of a neighbour", said="leave those rows out", doors=OURS,
        spoil=lambda run: put("q_0", slice(333, 343), run["q_1"][333:343])(run)),
    Mistake(name="60 rows frozen", said="the reading froze",
        spoil=lambda run: put("q_0", slice(400, 460), run["q_0"][400])(run)),
    Mistake(name="all joints frozen", spoil=all_frozen, said="the reading froze"),
    Mistake(name="degrees without a command", said='say unit = "deg" for it', doors=LED,
        spoil=led_with(made("q", lambda run: np.rad2deg(run["q"])))),
    Mistake(name="frozen reads without a command", said="the reading froze", doors=LED,
        spoil=led_with(lambda run: put("q", slice(400, 460), run["q"][400])(run))),
    Mistake(name="zeros without a command", said="the angle was not read there", doors=LED,
        spoil=led_with(lambda run: (put("q", slice(300, 400), -3.0)(run),
            put("q", slice(700, 720), -3.0)(run)))),
    Mistake(name="a torque in milliamperes", said="milliamperes", doors={CSV: LED[CSV]},
        spoil=led_with(made("force", lambda run: 3000.0 * run["force"]))),
    Mistake(name="a recorder that stalls", spoil=stalled, said="the recorder stood still"),
    Mistake(name="a seam in the middle", spoil=halfway, said="add the turns"),
    Mistake(name="angle and command in degrees", said='say unit = "deg" for it', doors=OURS,
        spoil=lambda run: run.update({n: np.rad2deg(run[n]) for n in run if n != "t"})),
    Mistake(name="an angle through a gear of three", said="or the other side of a gear",
        spoil=made("q_0", lambda run: run["q_0"] / 3.0)),
    Mistake(name="counts for angles", said="counts of an encoder", doors=ALONE,
        spoil=lambda run: run.update(
            {n: np.round(2048.0 + run[n] / TURN * 4096.0) for n in run if n != "t"})),
    Mistake(name="a size for an angle", said="its sign was lost",
        spoil=made("q_0", lambda run: np.abs(run["q_0"]))),
    Mistake(name="one sensor for two joints", said="one sensor stands for both",
        spoil=made("q_1", lambda run: run["q_0"].copy())),
    Mistake(name="the first rows not read", said="leave those rows out",
        spoil=lambda run: (away(run), put("q_0", slice(15), 0.0)(run))),
    Mistake(name="the last rows not read", said="leave those rows out",
        spoil=lambda run: (away(run), put("q_0", slice(-20, None), -2.0)(run))),
    Mistake(name="a zero that changes amid a run", said="its zero changed there",
        spoil=lambda run: run["q_0"].__setitem__(slice(480, None), run["q_0"][480:] + 0.5)),
    Mistake(name="a zero a quarter of a turn off", said="the zeros of theta and theta_d differ",
        doors=OURS, spoil=made("q_0", lambda run: run["q_0"] + 0.25 * TURN)),
    Mistake(name="the motor off for half of the time", spoil=off, said="the motor was off"),
)  # fmt: skip

COMMANDS: tuple[Mistake, ...] = (
    Mistake(name="joints exchanged", spoil=exchanged, said="columns of the joints are exchanged"),
    Mistake(name="angle and command exchanged", spoil=swapped, said="theta_d are exchanged",
        doors=OURS),
    Mistake(name="action and state exchanged", spoil=swapped, said="action are exchanged",
        doors=ALONE),
    Mistake(name="steps and their slow answer exchanged", said="are exchanged", spoil=stepped),
    Mistake(name="a command a row late", said="map the goal that was sent",
        spoil=made("goal_0", lambda run: np.roll(run["q_0"], 1))),
    Mistake(name="a command twelve rows late", said="some rows late",
        spoil=made("goal_0", lambda run: np.r_[np.zeros(12), run["goal_0"][:-12]])),
    Mistake(name="one column for both", said="no command was logged",
        spoil=made("goal_0", lambda run: run["q_0"].copy())),
    Mistake(name="actions relative to the angle", said="add that angle",
        spoil=made("goal_0", lambda run: run["goal_0"] - run["q_0"])),
    Mistake(name="changes row by row", said="add the changes up",
        spoil=made("goal_0", lambda run: np.diff(run["goal_0"], prepend=0.0))),
    Mistake(name="a speed command", said="it is a speed command",
        spoil=made("goal_0", lambda run: RATE * np.gradient(run["goal_0"]))),
    Mistake(name="a command of something else", said="must be the goal of this angle",
        spoil=made("goal_0", lambda run: run["goal_0"][::-1].copy())),
    Mistake(name="a constant command", said="it is no command of this motion",
        spoil=made("goal_0", lambda run: np.full(ROWS, 0.3))),
    Mistake(name="a goal that is lost", said="the goal was not logged there",
        spoil=lambda run: put("goal_0", slice(560, None), run["goal_0"][560])(run)),
    Mistake(name="no goal of any joint", said="it is no command of this motion",
        spoil=lambda run: run.update(goal_0=np.zeros(ROWS), goal_1=np.zeros(ROWS))),
    Mistake(name="no angle of any joint", said="or this is no reading of it",
        spoil=lambda run: run.update(q_0=np.full(ROWS, 0.2), q_1=np.full(ROWS, 0.1))),
    Mistake(name="nothing moves", spoil=still, said="nothing moves, so nothing can be told",
        thread="ros-claw/rosclaw#588"),
    Mistake(name="half a count moves", spoil=noisy_rest, thread="ros-claw/rosclaw#588",
        said="nothing moves, so nothing can be told"),
)  # fmt: skip

STAMPS: tuple[Mistake, ...] = (
    Mistake(name="a tenth of a second", spoil=cut, said="record 10 s or more", doors=OURS),
    Mistake(name="a clock that begins again", spoil=restarted, said="the clock restarted"),
    Mistake(name="stamps twice", spoil=doubled, said="their clock is too coarse"),
    Mistake(name="whole seconds", said="(rate = 80) in place", doors={CSV: OURS[CSV]},
        spoil=made("t", lambda run: np.floor(run["t"]))),
    Mistake(name="rows out of order", spoil=shuffled, said="sort them by t"),
    Mistake(name="rows that overtook others", spoil=overtaken, said="come out of order"),
    Mistake(name="a number beyond belief", spoil=put("q_0", FAILED[:4], -999.0),
        said="leave those rows out"),
    Mistake(name="one stamp in all rows", said="map another column as t",
        spoil=made("t", lambda run: np.zeros(ROWS))),
    Mistake(name="row numbers for stamps", said="or row numbers",
        spoil=made("t", lambda run: np.arange(ROWS, dtype=np.float64))),
    Mistake(name="the last row first", said="sort the rows by t",
        spoil=lambda run: run.update({name: run[name][::-1].copy() for name in run})),
    Mistake(name="a clock set ahead by an hour", said="the clock leaps", doors=ALONE,
        spoil=made("t", lambda run: run["t"] + np.where(np.arange(ROWS) < 500, 0.0, 3600.0))),
    Mistake(name="two rows a second", said="delays and lags below that are not told",
        doors=OURS, spoil=lambda run: run.update({n: x[::40] for n, x in run.items()})),
    Mistake(name="an infinite number", said="leave those rows out", doors={
        OWN: own_dataset, **ALONE}, spoil=put("q_0", slice(300, 301), np.inf)),
    Mistake(name="cells without numbers", said="leave those rows out", doors={
        OWN: own_dataset, **ALONE}, spoil=put("q_0", FAILED, np.nan)),
    Mistake(name="three seconds without rows", spoil=pause, said="gaps; the largest lasts",
        doors=OURS),
)  # fmt: skip

REGISTERS: tuple[Mistake, ...] = (
    Mistake(name="a load read as unsigned", said="read as unsigned", doors=OURS,
        spoil=made("current_0", lambda run: 2.69e-5 * register(load(run), 16, sized=False))),
    Mistake(name="an unsigned load of a coarse count", said="read as unsigned",
        spoil=made("current", lambda run: 2.69e-3 * register(load(run), 16, sized=False)),
        doors={CSV: csv_logs()}, thread="ROBOTIS-GIT/DynamixelSDK#281"),
    Mistake(name="a load as size and sign", said="is the sign of a size", doors=OURS,
        spoil=made("current_0", lambda run: 1e-3 * register(load(run) // 2, 10, sized=True))),
    Mistake(name="a current without sign", said="its sign was lost", doors=OURS,
        spoil=made("current_0", lambda run: np.abs(load(run)) * 1e-3)),
    Mistake(name="a supply that was not read", said="the register was not read there", doors=OURS,
        spoil=made("voltage", lambda run: np.where(np.isin(np.arange(ROWS), FAILED), 0.0, 7.4))),
    Mistake(name="a supply of nothing", said="the channel was not measured", doors=OURS,
        spoil=made("voltage", lambda run: np.zeros(len(run["t"])))),
    Mistake(name="a current that was not measured", said="the channel was not measured",
        spoil=made("current_0", lambda run: np.zeros(ROWS)), doors=OURS),
    Mistake(name="a speed in rev/min", spoil=speeds(60.0 / TURN), said="another unit",
        doors=OURS),
    Mistake(name="a speed in deg/s", spoil=speeds(360.0 / TURN), said="another unit", doors=OURS),
    Mistake(name="a speed of the other sign", spoil=speeds(-1.0), said="turn its sign", doors=OURS),
    Mistake(name="a temperature for a speed", said="map its own column", doors=OURS,
        spoil=lambda run: (speeds(1.0)(run),
            run.update(speed_0=31.0 + np.random.default_rng(1).normal(0.0, 0.5, ROWS)))),
    Mistake(name="enabled where it is off", said="enabled is 1 where", doors=OURS,
        spoil=made("enabled", lambda run: np.zeros(ROWS))),
    Mistake(name="a speed through the gear twice", spoil=speeds(1.0 / 270.0), said="gear",
        doors=OURS),
)  # fmt: skip

MISTAKES: tuple[Mistake, ...] = (*ANGLES, *COMMANDS, *STAMPS, *REGISTERS)
