"""Splitting imported logs by their circumstances, never by sample."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.errors import InvalidParameter, unknown_name

Conditions = Mapping[str, tuple[str, ...]]


@dataclass(frozen=True, kw_only=True)
class Split:
    """Logs by what they may be used for."""

    train: tuple[ImportedLog, ...]  # Logs that a fit may see
    test: tuple[ImportedLog, ...]  # Logs that are never fitted
    left_out: tuple[ImportedLog, ...]  # Logs that no condition selected
    chosen: bool = False  # Whether the test log was chosen here, since nobody named one


def split_logs(logs: Sequence[ImportedLog], test: Conditions, train: Conditions) -> Split:
    """Split logs; without train conditions every log that is not test is train.

    Without any condition one log is held out, if there are two.
    """
    if not test and not train and len(logs) > 1:
        return hold_one_out(logs)
    chosen = {
        name: {log.source for log in logs if conditions and meets(log, conditions)}
        for name, conditions in (("--test", test), ("--train", train))
    }
    for option, conditions in (("--test", test), ("--train", train)):
        check_conditions(logs, conditions, option)
        if conditions and not chosen[option]:
            raise InvalidParameter(f"{option} must select a log; {words(conditions)} selects none")
    both = chosen["--test"] & chosen["--train"]
    if both:
        raise InvalidParameter(
            f"a log belongs to one split; --test and --train both select {min(both).name}"
        )
    held = [log for log in logs if log.source in chosen["--test"]]
    rest = [log for log in logs if log.source not in chosen["--test"]]
    seen = [log for log in rest if not train or log.source in chosen["--train"]]
    if not seen:
        raise InvalidParameter(f"some log must be left to fit; --test {words(test)} takes them all")
    left_out = tuple(log for log in rest if log not in seen)
    return Split(train=tuple(seen), test=tuple(held), left_out=left_out)


def hold_one_out(logs: Sequence[ImportedLog]) -> Split:
    """Hold out the last log whose bench and numbers another log shares, else the last one."""

    def setting(log: ImportedLog) -> object:
        recording = log.recording
        return recording.bench, recording.bench_overrides, dict(recording.actuator_overrides)

    settings = [setting(log) for log in logs]
    shared = [log for log, own in zip(logs, settings, strict=True) if settings.count(own) > 1]
    held = (shared or logs)[-1]
    train = tuple(log for log in logs if log is not held)
    return Split(train=train, test=(held,), left_out=(), chosen=True)


def read_conditions(texts: Sequence[str], option: str) -> dict[str, tuple[str, ...]]:
    """Read conditions such as ``kp=100,200``; all of them must hold."""
    conditions: dict[str, tuple[str, ...]] = {}
    for text in texts:
        key, equals, values = text.partition("=")
        if not (key and equals and values):
            raise InvalidParameter(
                f"{option} must be given as key=value or key=value,value; it is {text!r}"
            )
        if key in conditions:
            raise InvalidParameter(
                f"{option} names {key!r} twice; several values go in one: {key}=a,b"
            )
        conditions[key] = tuple(values.split(","))
    return conditions


def meets(log: ImportedLog, conditions: Conditions) -> bool:
    """Tell whether a log meets all conditions."""
    return all(
        key in log.conditions and any(equals(log.conditions[key], value) for value in values)
        for key, values in conditions.items()
    )


def equals(stated: float | str, value: str) -> bool:
    """Compare a circumstance with a word from the command line; ``200`` equals ``200.0``."""
    if isinstance(stated, str):
        return stated == value
    try:
        return float(value) == stated
    except ValueError:
        return False


def check_conditions(logs: Sequence[ImportedLog], conditions: Conditions, option: str) -> None:
    """Refuse keys and values that no log has."""
    for key, values in conditions.items():
        stated = [log.conditions[key] for log in logs if key in log.conditions]
        if not stated:
            known = {name for log in logs for name in log.conditions}
            raise unknown_name(f"{option} condition", key, known)
        for value in values:
            if not any(equals(known, value) for known in stated):
                there = ", ".join(sorted({str(known) for known in stated}))
                raise InvalidParameter(f"{option} {key}={value} meets no log; there are {there}")


def words(conditions: Conditions) -> str:
    """Write conditions as they were given."""
    return " ".join(f"{key}={','.join(values)}" for key, values in conditions.items())
