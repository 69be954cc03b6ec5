"""What came closest where a gap is left, what stopped it, and what to do next."""

import shlex
from collections.abc import Iterator, Mapping

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.toml_file import read_toml
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.diagnosis.accounts.account_file import Account, state_accounts
from tendon_newton.diagnosis.accounts.account_words import percent, places, short_outcome, what
from tendon_newton.diagnosis.accounts.suspect_data import standing_apart
from tendon_newton.diagnosis.evaluation import evaluate_models, explained_fraction
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.diagnosis.search.decide.account import TOGETHER
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidDataset, InvalidDiagnosis, TendonNewtonError
from tendon_newton.identification.study import Study

CLOSE = 3  # Single causes that are told where no set was found
WORTH_SAYING = 0.1  # Share of the gap from which a cause came close [1]
GO_ON = "Let the search come to its end: run it again, with more --budget or without Ctrl-C."
"""What to do first after a search that was ended early."""
SECOND_BENCH = (
    "Record the same commands on a second bench: what stays is the servo's, what changes is the "
    "mechanism's."
)
UNLOADED = (
    "Record the same commands without what the servo carries: what stays is the servo's, what "
    "changes is its load's."
)
RECORD: dict[str, str] = {
    "theta": "slow ramps over the whole range, there and back",
    "theta_dot": "sines of several speeds",
    "theta_d": "steps of several sizes and slow ramps",
    "theta_d_change": "steps of several sizes",
    "force": "the same motion under another spring or load",
    "force_change": "the same motion under another spring or load",
    "t": "one motion, repeated for ten minutes",
    "time_since_reversal": "slow ramps with rests before they turn",
}
"""Signal that the rest depends on -> what shows more of it."""


def next_steps(
    diagnosis: Diagnosis, dataset: Dataset, model: Model, train: Study, closest: Mapping[int, float]
) -> tuple[str, ...]:
    """Say what to do next; nothing where no gap is left.

    Args:
        model: The model that was started from.
        closest: Parameter column -> value of the model that came closest.
    """
    if diagnosis.verdict in ("no_gap", "explained"):
        return ()
    benches = tuple(dict.fromkeys(r.bench for r in (*dataset.train, *dataset.test)))
    # beside a search that ended early, what is still missing stands apart everywhere
    odd = standing_apart(train, model, closest, benches) if diagnosis.finished else ()
    data = [suspect.text for suspect in odd]
    tried = tuple(came_closest(diagnosis)) if diagnosis.verdict == "unexplained" else ()
    apart = what_apart(led=train.is_led, kinematic=train.kinematic)
    last = to_record(diagnosis, apart) if diagnosis.finished else [GO_ON]
    return (*data, *tried, *better_start(dataset, model, diagnosis, train), *last)


def came_closest(diagnosis: Diagnosis) -> Iterator[str]:
    """Say which causes came closest and what stopped them."""
    table = CheckedTable(diagnosis.to_json(), "diagnosis", InvalidDiagnosis)
    causes = state_accounts(table).causes
    found = [c for c in causes if any(x.name == TOGETHER for x in c.failed)]
    if found:
        left = next(x for x in found[0].failed if x.name == TOGETHER)
        yield (
            f"{' with '.join(map(what, found))} came closest. What stopped "
            f"{'them' if len(found) > 1 else 'it'}: {percent(left.value)} of the squared error "
            f"above the noise is left, and at most {percent(left.bar)} may be."
        )
        return
    close = [c for c in sorted(causes, key=lambda c: -c.share)[:CLOSE] if c.share > WORTH_SAYING]
    yield from map(came_close, close)
    if causes and not close and diagnosis.finished:
        yield (
            f"No effect of the catalogue explains {percent(WORTH_SAYING)} of the gap alone: what "
            "is missing is probably none of them. An effect of your own is one file."
        )


def came_close(cause: Account) -> str:
    """Say of one cause how close it came and what stopped it."""
    return (
        f"{what(cause)} came close: it explains {percent(cause.share)} alone{places(cause)}. "
        f"What stopped it: {short_outcome(cause)}."
    )


def better_start(
    dataset: Dataset, model: Model, diagnosis: Diagnosis, train: Study
) -> Iterator[str]:
    """Compare with the model that lies beside the recordings, where it has another actuator."""
    given, file = model.actuator.name, dataset.path / "model.toml"
    if not file.is_file():
        if given == "ideal" and stated_mode(dataset) == "pwm":
            yield (
                "Your actuator is ideal; these were recorded in mode pwm. Start from pwm_servo "
                "with the numbers of the servo's data sheet (docs/model_file.md)."
            )
        return
    try:
        beside = load_model(file)
        if beside.actuator.name == given:
            return
        study = Study(dataset.test, beside, tuple(EFFECTS))
        (errors,) = evaluate_models(study, [{}])
    except TendonNewtonError:  # the file is no part of what was asked
        return
    share = explained_fraction(diagnosis.baseline, errors.pooled(), train.noise)
    if share > 0.0:
        yield (
            f"Your actuator is {given}; {file.name} beside the recordings says "
            f"{beside.actuator.name}, which alone and unfitted removes {percent(share)} of the "
            f"squared error above the noise. Start from it: --model {shlex.quote(str(file))}"
        )


def stated_mode(dataset: Dataset) -> str | None:
    """Return the servo's mode as the folder of the recordings states it; None where it does not."""
    file = dataset.path / "collection.toml"
    if not file.is_file():
        return None
    try:
        mode = read_toml(file, InvalidDataset, "a collection is a TOML file").get("mode")
    except InvalidDataset:
        return None
    return mode if isinstance(mode, str) else None


def what_apart(*, led: bool, kinematic: bool) -> str:
    """Say what to record to tell servo and mechanism apart; nothing where a path was led."""
    if led:
        return ""
    return UNLOADED if kinematic else SECOND_BENCH


def to_record(diagnosis: Diagnosis, apart: str) -> Iterator[str]:
    """Say what to record next; `apart` where all recordings are of one bench."""
    if diagnosis.baseline.force_rmse is None:
        yield "Record the force: without it servo and mechanism cannot be looked at apart."
    benches = {setting.bench for setting in diagnosis.recorded}
    if len(benches) == 1 and apart:
        yield f"All recordings are of {next(iter(benches))}. {apart}"
    signal = next((s for s in diagnosis.unexplained.depends_on if s in RECORD), None)
    if signal is not None:
        yield f"What is left depends most on {signal}: record {RECORD[signal]}."
