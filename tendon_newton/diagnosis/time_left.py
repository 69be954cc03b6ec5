"""How long a diagnosis will take, said before it starts, and how much of that is left."""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.search.decide.extent import beginnings, deciding
from tendon_newton.identification.cutting import rows_of
from tendon_newton.identification.study import Study, replacements

Progress = Callable[[str], None]

ONE_CAUSE, SEVERAL_CAUSES = (600, 80), (1900, 1700)
"""Candidates that are simulated on the beginnings of recordings, and on what decides, with a fifth
more for all that is not simulation: with one cause that leaves nothing (449 to 596, and 63 to 75),
and with several (593 to 2,303, and 926 to 2,122), counted on planted sets."""
TRIALS, ROUNDS = 64, 3
"""Candidates that are simulated to see how fast this computer is, and how often."""
TRIFLE = 1.0e-9  # By how much the first number of these candidates differs [its unit]
TRIAL_ROWS = 100  # Rows of a recording on which that is seen
SLOWDOWN = 2.0
"""Time that a candidate takes with several causes, dry friction among them, in that of the model as
it is [1]: 1.3 to 2.6, as timed."""
REPORT = 10.0  # Time that figures and files take [s]
TRAIN_RUNS, TEST_RUNS = 6, 28
"""Candidates that are simulated at the end on all training and on all test rows, at the search's
step: of three and of seven, at a half and at a quarter of it."""
DONE: tuple[tuple[str, float], ...] = (("testing", 0.6), ("deciding", 0.75), ("measuring", 0.95))
"""Beginning of a message -> share of the time that has passed by then, typically [1]."""


def measured_pace(recordings: Sequence[Recording], model: Model, study: Study) -> float:
    """Return the time that a candidate with several causes takes for a second of recordings [1].

    A part of one recording of each bench is simulated, by as many candidates as keep all cores
    busy.

    Args:
        recordings: Training recordings as they are.
        study: All rows of these recordings.
    """
    firsts = {r.bench: r for r in reversed(recordings)}.values()
    parts = [rows_of(r, slice(0, TRIAL_ROWS), r.name) for r in firsts]
    small = Study(parts, model, study.table.effects, time_step=study.time_step, scale=study.scale)
    candidates = replacements(nearly_alike(small, {}, TRIALS))
    small.residuals(*candidates)  # loads the kernels
    start = time.monotonic()
    for _ in range(ROUNDS):
        small.residuals(*candidates)
    taken = (time.monotonic() - start) / (TRIALS * ROUNDS)
    return SLOWDOWN * taken / sum(r.duration for r in parts)


def nearly_alike(study: Study, numbers: Mapping[int, float], count: int) -> list[dict[int, float]]:
    """Return candidates that take as long as one, column -> value: equal ones are simulated once.

    Args:
        numbers: Numbers of the candidate that differ from the model's own, column -> value.
    """
    first = numbers.get(0, study.base_value(0))
    return [{**numbers, 0: first + i * TRIFLE} for i in range(count)]


def expected_times(
    recordings: Sequence[Recording], study: Study, pace: float
) -> tuple[float, float]:
    """Return what a diagnosis will take [s], with one cause to find and with several.

    Args:
        recordings: Training recordings as they are.
        study: All rows of these recordings.
        pace: Time that a candidate takes for a second of recordings [1].
    """
    first = sum(r.duration for r in beginnings(recordings, whole=study.kinematic))
    decisive = sum(r.duration for r in deciding(recordings, whole=study.kinematic))
    one, several = (pace * (n * first + m * decisive) for n, m in (ONE_CAUSE, SEVERAL_CAUSES))
    return one, several


def finishing_time(dataset: Dataset, pace: float) -> float:
    """Return what the held-out recordings and the report take after the decision [s].

    Args:
        pace: Time that a candidate takes for a second of recordings [1].
    """
    train, test = (sum(r.duration for r in part) for part in (dataset.train, dataset.test))
    return REPORT + pace * (TRAIN_RUNS * train + TEST_RUNS * test)


def expectation(one: float, several: float) -> str:
    """Say what a diagnosis will take."""
    return (
        f"{time_text(one)} if there is one cause to find, {time_text(several)} if there are several"
    )


def time_left(message: str, elapsed: float) -> str:
    """Say how much time is left at a message, `elapsed` [s] after the start; empty if unknown."""
    done = next((share for begin, share in DONE if message.startswith(begin)), 0.0)
    return f", {time_text(elapsed * (1.0 - done) / done)} left" if done else ""


def notebook_progress() -> Progress:
    """Return what tells a notebook's reader what is being done; elsewhere nobody is told."""
    ipython: Any = sys.modules.get("IPython")
    if ipython is None or not hasattr(ipython.get_ipython(), "kernel"):  # no page, or a terminal
        return lambda _: None
    handle = ipython.display.display("starting ...", display_id=True)
    start = time.monotonic()

    def tell(text: str) -> None:
        elapsed = time.monotonic() - start
        handle.update(f"{elapsed:.0f} s  {text}{time_left(text, elapsed) or ''}")

    return tell


def time_text(seconds: float) -> str:
    """Return a time as a person would say it."""
    if seconds > 90.0:
        return f"about {seconds / 60.0:.0f} min"
    return f"about {max(1.0, seconds):.0f} s"
