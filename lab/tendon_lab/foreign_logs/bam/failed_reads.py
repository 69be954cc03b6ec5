"""Rows of a servo's log in which a register was not read, though a row was written."""

from collections.abc import Mapping

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.lint_checks import unread_rows
from tendon_newton.data.checks.mends import held
from tendon_newton.data.checks.read_checks import failed_rows
from tendon_newton.data.recording import Array, Mask


def without_failed_reads(
    columns: Mapping[str, Array], name: str
) -> tuple[dict[str, Array], list[Finding]]:
    """Leave out rows whose position was not read, and mend the supply where only that was not.

    A supply that was not read takes the last good value, since a supply of 0 V would stop a
    simulated motor.

    Args:
        columns: The log's columns, shape (T,) each.
        name: The recording, for the findings.
    """
    left_out = failed_rows(columns["position"][:, None], 0)
    findings = [failed(name, "theta", left_out, "left out: uneven sampling is allowed")]
    kept = {key: values[~left_out] for key, values in columns.items()}
    if "input_volts" in kept:
        bad = unread_rows(kept["input_volts"])
        kept["input_volts"] = held(kept["input_volts"], bad)
        findings.append(failed(name, "voltage", bad, "the last good value stands in their place"))
        if "temp" in kept:  # both come in one transaction
            lost = bad & (kept["temp"] <= 0.0)
            kept["temp"] = held(kept["temp"], lost)
    return kept, [finding for finding in findings if finding is not None]


def failed(name: str, channel: str, rows: Mask, done: str) -> Finding | None:
    """Say how many rows were not read, and what was done with them."""
    if not rows.any():
        return None
    return Examined(name, channel).caution(
        f"{rows.sum()} of {rows.size} rows, first row {int(rows.argmax())}",
        f"the register was not read there; {done}",
    )
