"""What the table of checks says of recordings that are to be diagnosed."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from tendon_newton.data.checks.command_checks import exchanges
from tendon_newton.data.checks.finding import Finding, kinds_of
from tendon_newton.data.checks.lint import lint_dataset, lint_recording
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.importers.arm_folder import beside
from tendon_newton.data.recording import Recording
from tendon_newton.mechanisms.bench_facts import facts_of


def findings_of(train: Sequence[Recording], test: Sequence[Recording] = ()) -> tuple[Finding, ...]:
    """Return what all checks find, what their benches cannot do among it."""
    own = [one for recording in (*train, *test) for one in findings_in(recording)]
    return (*lint_dataset(train, test), *own)


def findings_in(recording: Recording) -> Sequence[Finding]:
    """Return what the checks find in a recording alone."""
    facts = facts_of(recording.bench, recording.bench_overrides)
    return lint_recording(recording, bench=facts)


def faults_of(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Say what is wrong with recordings as they stand, each kind in a sentence."""
    wrong = [one for one in findings_of(recordings) if one.severity == "defect"]
    return tuple(
        f"Mend the data first, since no cause and no advice follows from them as they stand: "
        f"{group[0].channel} in {where(group)}: {group[0].evidence}; {group[0].consequence}."
        for group in kinds_of(wrong)
    )


def where(group: Sequence[Finding]) -> str:
    """Say in which recordings findings of a kind are."""
    first, more = group[0].recording, len(group) - 1
    return first if not more else f"{first} and {more} more"


def sound(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Return the recordings in which no check finds a defect."""
    return tuple(r for r in recordings if all(one.severity != "defect" for one in findings_in(r)))


def exchanges_between(datasets: Mapping[str, Dataset]) -> Iterator[Finding]:
    """Say which joints of an arm follow each other's commands, by recordings of the same rows."""
    names = list(datasets)
    for runs in zip(*(data.train for data in datasets.values()), strict=False):
        whole = beside(dict(zip(names, runs, strict=True)))
        for place, finding in exchanges(whole, names) if whole is not None else ():
            yield replace(finding, recording=runs[place].name)
