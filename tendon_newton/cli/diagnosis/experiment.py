"""Write the command of the run that separates causes which a diagnosis could not tell apart."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tendon_newton.diagnosis.next_experiment.separation import Prediction


@dataclass(frozen=True, kw_only=True)
class ExperimentConfig:
    """Write the command file of the run that separates causes a diagnosis could not tell apart.

    Every excitation of the library is simulated on every bench with every cause of the class. An
    imitator may refit its numbers as far as the data at hand leave them open; what it still cannot
    imitate counts. Writes FILE (CSV: t, theta_d), and beside it .toml (bench, repeats and what is
    expected of every run that was tried) and .png. Record the command on that bench, add the
    recording to the dataset with split = "train", and diagnose again. Where the diagnosis told all
    its causes apart the verb says so and writes nothing.
    """

    diagnosis: Annotated[Path, tyro.conf.Positional]
    """Folder that the verb diagnose wrote."""
    out: Path
    """Command file to write, ending in .csv; its folder is made if it is not there."""
    cause: str | None = None
    """Named cause whose class to separate; by default the first whose class a run separates."""
    benches: tuple[str, ...] = ()
    """Benches that you have; by default those of the data, and for a tendon all of the assets."""
    duration: float = 12.0
    """Length of the run [s]."""


def main(config: ExperimentConfig) -> None:
    """Find the run and write it."""
    from tendon_newton.data.files.text_file import make_folder
    from tendon_newton.device_code.quiet import quiet_warp
    from tendon_newton.errors import InvalidOutput, InvalidParameter, NothingToSeparate

    if not 2.0 <= config.duration <= 120.0:
        raise InvalidParameter(f"--duration must be 2 to 120 s; it is {config.duration:g}")
    if config.out.suffix != ".csv":
        raise InvalidOutput(f"{config.out}: a command file is a CSV file, NAME.csv")
    quiet_warp()

    from tendon_newton.diagnosis.next_experiment.open_class_file import read_open_class
    from tendon_newton.diagnosis.next_experiment.separation import SEEDS, propose
    from tendon_newton.diagnosis.next_experiment.separation_files import (
        draw_prediction,
        write_command,
        write_prediction,
    )

    try:
        question = read_open_class(config.diagnosis, config.cause)
    except NothingToSeparate as answer:
        print(f"no run is needed: {answer}")
        return
    make_folder(config.out.parent)
    names = [explanation.cause for explanation in question.explanations]
    print(f"  simulating {', '.join(names)} ...", flush=True)
    predictions = propose(
        question, benches=config.benches or None, seeds=SEEDS, duration=config.duration
    )
    write_command(config.out, predictions[0].plan)
    write_prediction(config.out.with_suffix(".toml"), predictions)
    draw_prediction(config.out.with_suffix(".png"), predictions)
    print(table(predictions))
    print(f"\n{advice(predictions[0])}")
    for suffix, what in ((".csv", "command"), (".toml", "bench and figures"), (".png", "picture")):
        print(f"  {what:18s} {config.out.with_suffix(suffix)}")


def table(predictions: Sequence[Prediction]) -> str:
    """Return the best runs as a table."""
    head = f"  {'bench':16s} {'excitation':14s} {'noise floors':>12s} {'mrad':>9s} {'N':>8s}  runs"
    rows = ["", head]
    for p in predictions:
        like = p.hardest
        force = "-" if like.force is None else f"{like.force:.3g}"
        rows.append(
            f"  {p.plan.place:16s} {p.plan.excitation:14s} {like.separation:12.2f} "
            f"{1e3 * like.theta:9.3g} {force:>8s}  {p.repeats or 'not enough'}"
        )
    return "\n".join(rows)


def advice(best: Prediction) -> str:
    """Say what to do."""
    if best.repeats is None:
        return (
            "No run of the library separates them, not even repeated: what differs is below the\n"
            "noise of the sensors on every bench that was tried. It takes another bench, a load\n"
            "or a sensor that only one of them moves. The command below comes closest."
        )
    return f"To separate them, {best.text()}."
