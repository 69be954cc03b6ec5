"""What is wrong with the joints of a LeRobotDataset, before anybody trains on it."""

from pathlib import Path

import numpy as np

from tendon_newton.data.checks.finding import Examined
from tendon_newton.data.checks.lint import lint_dataset, lint_recording
from tendon_newton.data.checks.measures import place_of
from tendon_newton.data.importers.joint_examination import (
    Examination,
    examine_joints,
    fails,
    pauses,
)
from tendon_newton.data.importers.lerobot.episodes import read_episodes
from tendon_newton.data.importers.lerobot.reading import (
    AS_TYPED,
    episode_findings,
    named_joints,
    numbers_of_joints,
    read_joints,
)
from tendon_newton.data.importers.lerobot.units import LeRobotUnits, angle_sizes

LEAST_ROWS = 60  # Rows of an episode below which it is not looked at; two seconds
WHOLE = 400.0  # [deg] no joint of an arm turns farther
COUNTS = 4096  # A turn of the encoders of most servos


def examine_dataset(folder: Path, units: LeRobotUnits = AS_TYPED) -> Examination:
    """Examine every joint of a LeRobotDataset.

    Args:
        units: What the joints' numbers mean; degrees where nobody says so and they are no radians.
            A percent of a range is about a degree.

    Raises:
        InvalidRecording: It is no LeRobotDataset, it is damaged, or all its episodes are short.
        MissingDependency: pyarrow is not installed.
    """
    info, rows = read_joints(folder)
    sizes = angle_sizes(units, numbers_of_joints(rows, info.joints))
    places = {place: sizes[place.name] for place in info.joints}
    episodes, unusable = read_episodes(folder, rows, places, LEAST_ROWS)
    wholes = [episode.whole for episode in episodes]
    every = [one for one in lint_dataset(wholes, ()) if one.severity == "defect"]
    seen = [one for whole in wholes for one in lint_recording(whole) if fails(one)]
    seen += [one for one in every if one.channel[-1].isdigit()]
    seen += [
        Examined("all", f"theta_{place}").defect(
            f"is in whole numbers of up to {np.abs(numbers).max():.6g}",
            f"those are counts of an encoder: write degrees, 360 / {COUNTS} of one",
        )
        for place, numbers in enumerate(numbers_of_joints(rows, info.joints).values())
        if units == AS_TYPED and np.abs(numbers).max() > WHOLE and (numbers % 1.0 == 0.0).all()
    ]
    found = {
        joint: [named_joints(one, info.joints) for one in seen if place_of(one.channel) == place]
        for place, joint in enumerate(sizes)
    }
    return Examination(
        joints=examine_joints(wholes, found),
        faults=(
            *(one for whole in wholes for one in pauses(whole)),
            *episode_findings(info, rows, unusable),
            *(named_joints(one, info.joints) for one in every if not one.channel[-1].isdigit()),
        ),
        in_radians=all(size == 1.0 for size in sizes.values()),
    )
