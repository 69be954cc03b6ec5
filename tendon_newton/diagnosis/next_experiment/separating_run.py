"""Which run of the library would tell a cause from those that look like it, in words."""

from collections.abc import Sequence

from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.expected_run import Forecast
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets
from tendon_newton.diagnosis.next_experiment.planned_runs import library_plans
from tendon_newton.diagnosis.next_experiment.run_design import SEED, usual_task

DURATION = 12.0  # Length of a proposed run [s]
LITTLE = 0.1  # A run that is expected to tell less tells nothing [bit]
NO_RUN = "no run of the library does"
"""Beginning of the proposal where no run tells the causes apart."""


def separating_run(
    question: OpenSets,
    settings: Sequence[Setting],
    names: Sequence[str],
    *,
    duration: float = DURATION,
) -> str:
    """Say which run tells causes apart, without a full stop.

    Every set is simulated on every bench with every excitation. A set may refit its numbers within
    what the data leave open, so that only what it cannot imitate counts.

    Args:
        question: The sets, equally likely, one for each cause.
        settings: Benches that may be used.
        names: The causes.
        duration: Length of the run [s].
    """
    forecast = Forecast(question, usual_task(settings[0], duration))
    found = forecast.runs(library_plans(settings, (SEED,), duration))
    best = max(found, key=lambda expected: expected.told.names)
    run = f"{duration:.0f} s of {best.plan.excitation.replace('_', ' ')} on bench {best.plan.place}"
    bits = f"of {forecast.entropy:.1f} bits that tell {' from '.join(names)}, {best.told.names:.1f}"
    if best.told.names < LITTLE:
        return f"{NO_RUN}: {bits} are expected of the best, {run}; a further sensor may"
    return f"record {run}: {bits} are expected"
