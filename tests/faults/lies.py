"""Servos that acknowledge and pull otherwise, and encoders that lie: no register tells of either.

Each is tried on a finger that holds its goal, on one that is moved to and fro, and on one that is
pulled hard. A lie that changes nothing while a finger holds is looked for when it is moved.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count
from math import log, pi
from typing import Any

import numpy as np

from tendon_hardware.deployment.deploy_settings import DeploySettings, loops_of
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.rule_limits import DeployLimits
from tests.faults import injections as on
from tests.faults.cases import Case, always
from tests.faults.injections import LONG, let
from tests.hardware.deploy.policies import card_of_two, policy_of
from tests.hardware.deploy.runs import Flight

PERIOD = 20  # Policy steps for which a finger is moved one way: a second
REST = 1.6  # Time in which a finger comes to rest [s]
SETTINGS = DeploySettings(
    duration=12.0, limits=DeployLimits(bench=SafetyLimits(force=60.0))
)  # the stronger servo pulls 43 N


def swinging() -> Callable[[], float]:
    """Return a policy that pulls and lets go in turn."""
    step = count()
    return lambda: -2.0 if (next(step) // PERIOD) % 2 else 2.0


STATES: dict[str, dict[str, Any]] = {
    "held": {"settled": REST},
    "moved": {"bad": swinging},
    "pulled hard": {"bad": always(2.0), "settled": REST},
}
"""What a finger does when the lie begins."""


def lies(
    name: str,
    fault: Any,
    within: dict[str, float],
    *,
    rule: str = "motion",
    action: str = "off",
    **words: Any,
) -> dict[str, Case]:
    """Return a lie in each of the states, with the time in which it must be noticed [s]."""
    return {
        f"{name}, {state}": Case(
            rule=rule, action=action, fault=fault, allowed=allowed, settings=SETTINGS,
            **STATES[state], **words,
        )
        for state, allowed in within.items()
    }  # fmt: skip


def all_states(seconds: float) -> dict[str, float]:
    """Return one time for every state [s]."""
    return dict.fromkeys(STATES, seconds)


ENCODERS: dict[str, Case] = {
    **lies("an encoder a turn ahead", on.misread(lambda a, t: a + 2.0 * pi), all_states(0.1),
        sooner=("position_window",), own=True),  # a Feetech servo tells no turns
    **lies("an encoder 0.5 rad ahead", on.misread(lambda a, t: a + 0.5), all_states(0.1)),
    **lies("an encoder 0.5 rad behind", on.misread(lambda a, t: a - 0.5), all_states(0.1)),
    **lies("an encoder of half a scale", on.misread(lambda a, t: 0.5 * a), all_states(0.1)),
    **lies("an encoder that jumps to and fro",
        on.misread(lambda a, t: a + (0.5 if t % 0.2 < 0.1 else -0.5)), all_states(0.1)),
    **lies("an encoder that runs ahead by 1 rad/s", on.misread(lambda a, t: a + t),
        {"held": 0.5, "moved": 6.0, "pulled hard": 6.0}, sooner=("load_cell",)),
    **lies("an encoder that falls behind by 1 rad/s", on.misread(lambda a, t: a - t),
        {"held": 0.5, "moved": 3.0, "pulled hard": 1.5}),
    **lies("a stuck encoder", on.lag(100.0), {"moved": 3.0}, rule="encoder",
        sooner=("load_cell", "motion")),
    **lies("an encoder 0.3 s late", on.lag(0.3), {"moved": 2.0}, sooner=("load_cell",)),
}  # fmt: skip
"""Encoders that lie, speed and all."""

SERVOS: dict[str, Case] = {
    **{
        name: case
        for duty in (0.6, 0.3, -0.3, 0.0)
        for name, case in lies(f"a duty stuck at {duty:g}", on.pull(duty), all_states(0.2),
            rule="duty", sooner=("motion",)).items()
    },
    **lies("a duty of 0.6 and none told", on.pull(0.6, echo=True), all_states(0.5)),
    **lies("a duty of 0.3 and none told", on.pull(0.3, echo=True), {"held": 1.5, "moved": 2.5}),
    **lies("a duty of -0.3 and none told", on.pull(-0.3, echo=True), all_states(0.5)),
}  # fmt: skip
"""Servos that pull otherwise than they are told."""


@dataclass(kw_only=True)
class NotOff(Case):
    """A motor that has a duty of its own once it was switched off; the program must say so."""

    def examine(self, after: float, servo: str = "xc330_t288_t") -> float | None:
        """Fly, and require that the operator is told; the run itself is as it should be."""
        flight = self.prepared(after, servo)
        outcome = flight.fly()
        assert flight.duty_after, "the motor pulls on"
        told = flight.operator.told
        assert any("SWITCH ITS SUPPLY OFF" in text for text in told), told
        assert outcome.fault is not None
        return None


PULLS_ON = {
    "a motor that is on at 0.6 once it is off": on.pull(0.6, off=True),
    "a motor that is on at 0.3 once it is off": on.pull(0.3, off=True),
    "a motor that is on at 0.3 once it is off, and tells nothing": on.pull(
        0.3, off=True, echo=True
    ),
    "a motor that is on at 0.6, off or not": on.both(on.pull(0.6), on.pull(0.6, off=True)),
}
OFF: dict[str, Case] = {
    name: NotOff(rule="", action="", fault=fault, settings=DeploySettings(duration=1.5))
    for name, fault in PULLS_ON.items()
}
"""Motors that pull on after they were switched off."""


@dataclass(kw_only=True)
class Weak(Case):
    """A fault beside the weakest servo."""

    own: bool = True

    def prepared(self, after: float, servo: str = "") -> Flight:
        """Prepare a deployment with it."""
        return super().prepared(after, "xl330_m288_t")


HALF_FROM_REST: dict[str, Any] = {
    "rule": "pull", "sooner": ("tension",), "action": "unwind", "allowed": 2.5, "calm": True,
    "bad": always(2.0), "fault": on.lie(lambda f, t, k: 0.5 * f),
    "settings": replace(SETTINGS, limits=DeployLimits(bench=SafetyLimits(force=4.0))),
}  # fmt: skip
CELL: dict[str, Any] = {"rule": "load_cell", "action": "unwind"}
CELLS: dict[str, Case] = {
    **lies("a load cell of a quarter of its gain", on.lie(lambda f, t, k: 0.25 * f),
        {"held": 0.1, "pulled hard": 0.1}, **CELL),
    **lies("a load cell of half its gain", on.lie(lambda f, t, k: 0.5 * f),
        {"held": 0.1, "pulled hard": 0.1}, **CELL),
    **lies("a load cell that tells the logarithm", on.lie(lambda f, t, k: log(1.0 + max(f, 0.0))),
        {"held": 0.1, "pulled hard": 0.1}, **CELL),
    **lies("a load cell that is dead, noise and all", let("cell_deaf", duration=LONG),
        {"moved": 2.5, "pulled hard": 1.5}, sooner=("motion",), **CELL),
    **lies("a load cell 0.3 s late", on.late(0.3), {"moved": 8.0}, **CELL),
    "a load cell of half its gain, pulled hard from rest, at a limit of 4 N":
        Case(**HALF_FROM_REST),
    "a load cell of half its gain, pulled hard from rest, at a limit of 12 N": Case(
        strong=True, **HALF_FROM_REST | {"rule": "tension", "sooner": ("pull",),
        "settings": replace(SETTINGS, limits=DeployLimits(bench=SafetyLimits(force=12.0)))}),
    "an XL330's load cell of half its gain, pulled hard from rest, at a limit of 4 N":
        Weak(**HALF_FROM_REST),
    **{
        f"{name} on a string with 4 kg": Case(
            rule="motion", sooner=("load_cell", "tension"), action="off", allowed=0.5,
            fault=on.both(on.pull_at(4.0), lie), settings=SETTINGS, settled=REST)
        for name, lie in {
            "a load cell that is dead, noise and all,": let("cell_deaf", duration=LONG),
            "a load cell of a quarter of its gain": on.lie(lambda f, t, k: 0.25 * f),
        }.items()
    },
}  # fmt: skip
"""Load cells that lie as live ones do."""
TWO = card_of_two()
TWO_SETTINGS = replace(SETTINGS, loop=loops_of(TWO)[0], further_loops=loops_of(TWO)[1:])


def to_and_fro(sample: np.ndarray) -> np.ndarray:
    """Wind in with the first servo and let out with the second, then the other way round."""
    closing = sample[0] < (1.2 if sample[4] > 0.0 else 0.3)
    return 1.5 * np.array([1.0, -1.0]) * (1.0 if closing else -1.0)


def squeezing() -> Callable[[np.ndarray], np.ndarray]:
    """Return a policy that pulls with both servos and lets both go in turn."""
    swing = swinging()
    return lambda sample: np.full(2, 0.75 * swing())


def two(fault: Any, seconds: float, policy: Any = to_and_fro, **words: Any) -> Case:
    """Return a fault of two strings, which a policy moves to and fro unless another is given."""
    return Case(
        fault=fault, allowed=seconds, settings=TWO_SETTINGS, **CELL | words,
        words={"bench": "finger_antagonist", "policy": policy_of(policy, TWO)},
    )  # fmt: skip


PAIRS: dict[str, Case] = {
    "two load cells exchanged": two(on.exchange, 8.0),
    "a load cell that tells another's counts": two(on.copy, 0.3),
    **{
        f"two encoders {name}": two(fault, 1.0, rule="motion", action="off", sooner=("load_cell",))
        for name, fault in {
            "0.5 rad ahead": on.misread(lambda a, t: a + 0.5),
            "of half a scale": on.misread(lambda a, t: 0.5 * a),
            "that run ahead by 1 rad/s": on.misread(lambda a, t: a + t),
            "that fall behind by 1 rad/s": on.misread(lambda a, t: a - t),
            "that are stuck": on.lag(100.0),
            "0.3 s late": on.lag(0.3),
        }.items()
    },
    "two encoders that are stuck, both strings pulled": two(
        on.lag(100.0), 3.0, squeezing(), sooner=("motion",)
    ),
}
"""Load cells whose plugs are exchanged, and encoders that lie, where a finger has two strings."""
LIES = ENCODERS | SERVOS | OFF | CELLS | PAIRS
CHEAP = {
    name: LIES[name]
    for name in (
        "an encoder 0.5 rad ahead, held",
        "an encoder that runs ahead by 1 rad/s, held",
        "a stuck encoder, moved",
        "a duty stuck at 0.6, held",
        "a duty of 0.6 and none told, held",
        "a motor that is on at 0.3 once it is off",
        "a motor that is on at 0.3 once it is off, and tells nothing",
        "a load cell of half its gain, held",
        "a load cell of half its gain, pulled hard from rest, at a limit of 4 N",
        "a load cell 0.3 s late, moved",
        "two encoders that are stuck",
        "an XL330's load cell of half its gain, pulled hard from rest, at a limit of 4 N",
        "two load cells exchanged",
        "a load cell that tells another's counts",
    )
}
"""One of each kind, for every run of the tests."""
