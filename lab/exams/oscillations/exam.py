"""Exam of `oscillation`: ``python -m lab.exams.oscillations.exam --seed 1 --out FILE``.

For each of four causes loops are drawn that shake with it and do not without it, by the plant's
own test: a goal that stays after a jump. As many calm logs come from sound loops and from loops
whose fault is too small to shake. A log has noise, counts, steps and slow motions of its goal, and
ends with a goal that stays.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lab.exams.one_by_one import main
from lab.exams.oscillations.plant import CAUSES, Array, Loops, drawn, run
from tendon_newton.data.oscillations.shaking import evenly
from tendon_newton.data.oscillations.told_loop import tell_joint
from tendon_newton.data.recording import Indices, Mask

DRAWS: Mapping[str, int] = {"gain": 12, "delay": 12, "play": 6, "sticking": 40}
"""Loops that are drawn for one that is taken."""
SHAKES, RESTS = 8e-3, 2e-3  # Amplitude of a loop that shakes, and most of one that does not [rad]
SLOWEST, FASTEST = 0.4, 15.0  # Frequencies that are taken [Hz]
ROWS_A_PERIOD = 5.0  # Rows that a period must have, at least
NEAR, CALMED = 0.1, 0.25
"""Share by which a frequency may be off, and of the amplitude that may be left [1]."""
MOVING, PERIODS, LEAST_HOLD = 10.0, 14.0, 12.0
"""Time in which the goal moves [s]; periods and time [s] for which it stays then."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One log and its truth."""

    cause: str  # ``calm`` where it does not shake
    frequency: float  # Of the true angle while the goal stays [Hz]
    loop: Loops  # Alone
    time: Array
    command: Array
    angle: Array


def held(loops: Loops, duration: float = 16.0) -> tuple[Array, Array, Array]:
    """Jump and stay: amplitude early and at the end [rad], and frequency at the end [Hz]."""
    count = round(1e3 * duration)
    goal = np.full((count, len(loops.row)), 0.2)
    goal[0] = 0.0
    _, _, angle = run(loops, goal, np.zeros_like(goal), 0.0)
    early, tail = angle[count // 4 : count // 2], angle[count // 2 :]
    paces = np.array([pace(column) for column in tail.T])
    return 0.5 * np.ptp(early, axis=0), 0.5 * np.ptp(tail, axis=0), paces


def pace(angle: Array) -> float:
    """Return how often a second an angle swings through its middle, both ways by a third [Hz]."""
    middle = angle - 0.5 * (angle.max() + angle.min())
    band = 0.33 * np.abs(middle).max()
    side = np.where(middle > band, 1, np.where(middle < -band, -1, 0))
    far = np.flatnonzero(side)
    up = far[1:][(side[far[1:]] > 0) & (side[far[:-1]] < 0)]
    return 1e3 * (len(up) - 1) / float(up[-1] - up[0]) if len(up) > 2 else 0.0


def cases(seed: int, each: int) -> Iterator[Case]:
    """Draw logs that shake, so many of each cause, and as many calm ones."""
    rng = np.random.default_rng(seed)
    for cause in CAUSES:
        faulty, sound = drawn(rng, cause, DRAWS[cause] * each)
        early, late, paces = held(faulty)
        highest = np.minimum(FASTEST, 1.0 / (ROWS_A_PERIOD * faulty.row))
        taken = (late > SHAKES) & (paces > SLOWEST) & (paces < highest)
        chosen = shared(taken, faulty.outer, 2 * each)
        well = chosen[np.maximum(*held(sound.at(chosen))[:2]) < RESTS]
        durations = MOVING + np.maximum(LEAST_HOLD, PERIODS / paces[well])
        shaking = logged(rng, cause, faulty.at(well), durations)
        yield from half_of_policies(shaking, each)
        small = shared(np.maximum(early, late) < RESTS, faulty.outer, each)
        few = np.full(len(small), float(np.median(durations)))
        yield from half_of_policies(logged(rng, "calm", faulty.at(small), few), each // 2)
        calm = logged(rng, "calm", sound.at(well), durations)
        yield from half_of_policies(calm, each - each // 2)


def half_of_policies(found: Iterator[Case], count: int) -> list[Case]:
    """Return the first cases, half of them a policy's where there are so many."""
    every = list(found)
    chosen = shared(
        np.ones(len(every), dtype=np.bool_), np.array([case.loop.outer[0] for case in every]), count
    )
    return [every[k] for k in chosen]


def shared(taken: Mask, outer: Array, count: int) -> Indices:
    """Return the first loops of those that are taken, half of them a policy's where there are."""
    policies, servos = (np.flatnonzero(taken & (outer == kind)) for kind in (1.0, 0.0))
    half = max(min(len(policies), count // 2), count - len(servos))
    return np.r_[policies[:half], servos[: count - half]]


def logged(rng: np.random.Generator, cause: str, loops: Loops, durations: Array) -> Iterator[Case]:
    """Run loops and return their logs."""
    number = len(loops.row)
    count = round(1e3 * float(durations.max()))
    goal = np.stack([goals(rng, count) for _ in range(number)], axis=1)
    noise = rng.normal(size=goal.shape) * np.exp(rng.uniform(np.log(1e-4), np.log(1e-3), number))
    command, angle, truth = run(loops, goal, noise)
    for k in range(number):
        every = round(1e3 * float(loops.row[k]))
        rows = np.arange(0, round(1e3 * durations[k]), every)
        stays = truth[round(1e3 * MOVING) + 2000 : rows[-1], k]
        shakes = 0.5 * np.ptp(stays[len(stays) // 4 :]) > SHAKES and pace(stays) > 0.0
        if shakes != (cause in CAUSES):
            continue  # after another jump than that of the test
        yield Case(
            cause=cause,
            frequency=pace(stays) if cause in CAUSES else 0.0,
            loop=loops.at(np.array([k])),
            time=np.asarray(1e-3 * rows, dtype=np.float64),
            command=command[rows, k],
            angle=angle[rows, k],
        )


def goals(rng: np.random.Generator, count: int) -> Array:
    """Draw a goal of steps or slopes with slow motions beside, which stays after a while [rad]."""
    time = np.minimum(1e-3 * np.arange(count), MOVING)
    turns = np.cumsum(rng.uniform(0.8, 3.0, 20))
    levels = np.repeat(rng.uniform(-0.4, 0.4, 21), 2)
    slope = 1e-3 if rng.random() < 0.5 else float(rng.uniform(0.1, 0.7))
    knots = np.sort(np.r_[turns - 0.5 * slope, turns + 0.5 * slope])
    swing = float(rng.choice([0.0, 0.1, 0.3])) * np.sin(
        2.0 * np.pi * rng.uniform(0.05, 0.3) * time + rng.uniform(0.0, 6.0)
    )
    return np.interp(time, knots, levels[1:-1]) + swing


def changed(loop: Loops, proposal: Mapping[str, float]) -> Loops:
    """Return a loop after what is proposed: factors of gains and play, seconds less of delay."""
    gain, integral = proposal.get("gain", 1.0), proposal.get("integral", 1.0)
    inside = loop.outer == 0.0
    return loop.but(
        servo_gain=np.where(inside, gain, 1.0) * loop.servo_gain,
        servo_integral=np.where(inside, integral, 1.0) * loop.servo_integral,
        gain=gain * loop.gain,
        integral=integral * loop.integral,
        delay=np.maximum(0.0, loop.delay - proposal.get("less_delay", 0.0)),
        play=loop.play * proposal.get("play", 1.0),
    )


def answer(case: Case) -> dict[str, Any]:
    """Return truth and answer of one log, and whether the plant is calm after the change."""
    told = tell_joint(evenly(case.time, case.command, case.angle))
    row: dict[str, Any] = {
        "cause": case.cause,
        "policy": bool(case.loop.outer[0] > 0.0),
        "frequency": case.frequency,
        "shakes": told.shaking is not None,
    }
    if told.shaking is None or told.explained is None or told.loop is None:
        return row
    row |= {"told": told.explained.cause, "told_frequency": told.shaking.frequency}
    if case.cause in CAUSES and told.explained.changes:
        change = told.explained.changes[0]
        proposal = {change.what: change.share}
        if change.what == "delay":
            proposal = {"less_delay": (1.0 - change.share) * told.loop.number("delay")}
        elif change.what == "gain" and not told.loop.feedback.outer:
            proposal["integral"] = change.share
        _, before, _ = held(case.loop)
        _, after, _ = held(changed(case.loop, proposal))
        row |= {"change": proposal, "calms": bool(after[0] < max(RESTS, CALMED * before[0]))}
    return row


def score(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the rates, with those of one constant answer beside them."""
    shaking = [row for row in rows if row["cause"] in CAUSES]
    calm = [row for row in rows if row["cause"] not in CAUSES]
    near = [
        row
        for row in shaking
        if abs(row.get("told_frequency", 0.0) - row["frequency"]) < NEAR * row["frequency"]
    ]
    right = {
        cause: [sum(row.get("told") == cause for row in own), len(own)]
        for cause in CAUSES
        if (own := [row for row in shaking if row["cause"] == cause])
    }
    return {
        "cause_first": [sum(one for one, _ in right.values()), len(shaking)],
        "by_cause": right,
        "best_constant_answer": [max(count for _, count in right.values()), len(shaking)],
        "frequency": [len(near), len(shaking)],
        "change_calms": [sum(row.get("calms", False) for row in shaking), len(shaking)],
        "calm_and_silent": [sum(not row["shakes"] for row in calm), len(calm)],
        "always_silent": [len(calm), len(calm)],
    }


if __name__ == "__main__":
    main(__doc__, (10, "logs of each cause"), cases, answer, score)
