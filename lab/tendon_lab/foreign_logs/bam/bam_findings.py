"""What the registers of a servo tell about its own logs."""

from collections.abc import Iterator, Mapping, Sequence

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.importers.imported import ImportedLog


def log_findings(log: ImportedLog, wraps: Mapping[str, int]) -> Iterator[Finding]:
    """Say which values of a log were unwrapped.

    Args:
        log: The log.
        wraps: Rows of ``load`` and ``speed`` that held a negative value as an unsigned one.
    """
    for channel, count in (("duty", wraps.get("load", 0)), ("theta_dot", wraps.get("speed", 0))):
        if count:
            yield Examined(log.recording.name, channel).caution(
                f"{count} of {log.recording.sample_count} rows of the source held negative "
                "values read as unsigned 16-bit counts",
                "unwrapped on import; whoever reads the source must do so too",
            )


def arm_findings(logs: Sequence[ImportedLog]) -> Iterator[Finding]:
    """Say that nobody knows what the arm weighs, where that is so."""
    if not any("arm_mass" in log.conditions for log in logs):
        yield Examined("all", "mass").caution(
            "the arm's own mass is not logged, only that of the weight at its end",
            "inertia and gravity torque are somewhat larger than the bench says; logs "
            "with several loads tell it, and the model then has arm_mass among its unknown numbers",
        )
