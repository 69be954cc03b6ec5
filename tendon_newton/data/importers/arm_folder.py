"""Joints of an arm that lie in a dataset each, put beside each other again."""

from collections.abc import Mapping
from dataclasses import replace
from functools import reduce

import numpy as np

from tendon_newton.data.checks.command_checks import exchanges
from tendon_newton.data.checks.read_checks import neighbours_reads
from tendon_newton.data.importers.joint_examination import Examination, examine_joints, fails
from tendon_newton.data.importers.own import OwnDataset
from tendon_newton.data.recording import SERVO, Array, Recording

TOGETHER = 0.5  # Share of its rows that a joint has in common with the others [1]


def examine_arm(datasets: Mapping[str, OwnDataset]) -> Examination | None:
    """Examine the joints of an arm beside each other; None where no arm was logged together.

    What the datasets' own findings say is not said again.

    Args:
        datasets: Joint -> its recordings.
    """
    each = {joint: (*own.train, *own.test) for joint, own in datasets.items()}
    if len({len(own) for own in each.values()}) != 1:
        return None
    motions = [
        beside(dict(zip(each, own, strict=True))) for own in zip(*each.values(), strict=True)
    ]
    wholes = [whole for whole in motions if whole is not None]
    if len(wholes) < len(motions):
        return None
    found = {
        joint: [
            replace(one, recording=one.recording.removeprefix(f"{joint}_"))
            for one in own.findings
            if fails(one)
        ]
        for joint, own in datasets.items()
    }
    between = (exchanges, neighbours_reads)
    other = [one for whole in wholes for find in between for one in find(whole, [*each])]
    for place, joint in enumerate(found):
        found[joint] += [one for own, one in other if own == place]
    said = {one.check for own in datasets.values() for one in own.findings}
    return Examination(
        joints=tuple(
            replace(joint, faults=tuple(one for one in joint.faults if one.check not in said))
            for joint in examine_joints(wholes, found)
        )
    )


def beside(joints: Mapping[str, Recording]) -> Recording | None:
    """Return one motion of joints in the rows that all of them have; None where these are few."""
    own = [*joints.values()]
    if any(one.bench != SERVO or one.command is None or one.tendon_count > 1 for one in own):
        return None
    time = reduce(np.intersect1d, [one.time for one in own])
    if len(time) < max(2, TOGETHER * max(one.sample_count for one in own)):
        return None
    rows = [np.searchsorted(one.time, time) for one in own]

    def columns(name: str) -> Array:
        parts = [getattr(one, name)[at, 0] for one, at in zip(own, rows, strict=True)]
        return np.stack(parts, axis=1)

    first = next(iter(joints))
    return Recording(
        name=joints[first].name.removeprefix(f"{first}_"),
        bench=SERVO,
        time=time,
        command=columns("command"),
        motor_position=columns("motor_position"),
        motor_velocity=columns("motor_velocity"),
        enabled=np.all([one.enabled[at] for one, at in zip(own, rows, strict=True)], axis=0),
        start="first_row",
    )
