"""Name what a model gets wrong about measured data, extend it, and measure the gain.

The model is simulated under the recorded commands. Where it errs by more than the sensors do,
effects of a catalogue (friction, delay, slack, ...) are added and fitted together. Those that
the data ask for are named, with numbers and 95 % intervals. The verdict is one of:
  no_gap            the error is noise
  explained         the named causes account for the error
  partly_explained  the named causes are real, and something else remains
  unexplained       there is an error, and no cause accounts for it; the answer says what came
                    closest, what stopped it and what to do next

Before the search starts its data are checked, and the time that it will take is told. Ctrl-C
ends the search and reports what it has so far, said to be unfinished.

OUT gets report.html (for people), diagnosis.json (for programs), model.toml (the extended model,
usable as the next --model). tendon-newton export OUT --to usd has the mechanism as USD.
Then ask why a cause was named or not: tendon-newton explain OUT.

With --against nothing is searched. Numbers of an earlier answer, and those that walk from day
to day (slack, friction, offsets, ...), are fitted to the new recordings. changes.html says which
moved, by how much, with what probability, and what to do; and what happened within recordings: a
slip of the string, a skip of the angle, a knock, a dip of the supply. After a mend, --mended says
whether the cause went away.

A LeRobotDataset, by its folder or its id on the Hub, is taken as it is, and so is a folder with a
dataset of each joint of an arm: OUT gets a folder for each joint. With --arm gravity by posture
loads each servo, a floor under the tip is looked for, and all servos are simulated together on the
test recordings.

Examples:
  tendon-newton diagnose recordings --out results --budget 5min
  tendon-newton diagnose DATASET --unit deg --arm so101.urdf --out results
"""

from __future__ import annotations

import json
import os
import shlex
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TextIO

import tyro

from tendon_newton.cli.duration import read_duration
from tendon_newton.cli.heap import share_heap
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.errors import InvalidModelFile, InvalidParameter

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from tendon_newton.data.checks.finding import Finding
    from tendon_newton.data.dataset import Dataset
    from tendon_newton.data.model_file import Model
    from tendon_newton.diagnosis.result import Diagnosis, NamedEffect


RECORDINGS = "recordings"  # Folder beside the results with the joints of a LeRobotDataset
LAST = 0.3  # Share of a LeRobotDataset's only episode that is held out [1]


@dataclass(frozen=True, kw_only=True)
class DiagnoseConfig:
    """What to diagnose, from which model, and how."""

    dataset: Annotated[Path, tyro.conf.Positional]
    """Folder with dataset.toml and its recordings, or with such a folder for each joint of an arm,
    or a LeRobotDataset, whose last episode is held out; test recordings only report the error."""
    out: Path  # Folder for the results; made if it is not there.
    model: Path | None = None
    """Model file or known servo to start from; by default model.toml beside the recordings."""
    against: Path | None = None
    """Earlier day, as its dataset or the folder of its diagnosis: say what has changed since. The
    dataset may be a folder of datasets then, one a day."""
    mended: tuple[str, ...] = ()
    """With --against: causes that were mended since. The answer says whether their numbers moved,
    and how far."""
    arm: str | None = None
    """Asset of the arm whose joints have the names of those in DATASET: a name or a file, which may
    be a URDF or an MJCF."""
    unit: str | None = None
    """What the joints of a LeRobotDataset are in, rad, deg or percent; seen where they are
    radians."""
    calibration: Path | None = None
    """The LeRobot arm's calibration file, which says what 100 percent are."""
    test: tuple[str, ...] = ()
    """For a LeRobotDataset: episodes that only report the error, such as episode=3,4; the last one
    by default."""
    mend: bool = False
    """For a LeRobotDataset: leave out rows that were not read, and what else findings say that
    --mend does."""
    hold_out: float | None = None
    """Share of each recording, from its end, that only reports the error: for a dataset without
    test recordings, such as one long log of a deployment."""
    budget: str | None = None
    """Time that all of it may take, about: 90s, 5min, 1h. What is found by then is reported."""
    jobs: int | None = None  # Cores to simulate on; all of them by default.
    json: bool = False
    """Print diagnosis.json and nothing else, for a folder of joints one object with that of each
    under joints, and arm.json under arm; progress goes to the error stream."""


def main(config: DiagnoseConfig) -> None:
    """Diagnose and write what was found."""
    start = time.monotonic()
    share_heap()
    quiet_warp(on_errors=config.json)
    limit_cores(config.jobs)
    progress = DiagnosisProgress(sys.stderr if config.json else sys.stdout, start)
    until = None if config.budget is None else start + read_duration(config.budget, "--budget")
    if config.against is None:
        find_causes_in(config, progress, until)
    else:
        say_changes(config, config.against, progress)


def find_causes_in(
    config: DiagnoseConfig, progress: DiagnosisProgress, until: float | None
) -> None:
    """Diagnose a dataset, or each joint of an arm, until an instant [s] about."""
    from tendon_newton.data.dataset import dataset_folders

    if config.mended:
        raise InvalidParameter("--mended needs --against: the recordings from before the mend")
    lerobot, folders = lerobot_folder(config.dataset), dataset_folders(config.dataset)
    if lerobot is None:
        refuse_lerobot_options(config)
    if lerobot is None and not folders:
        diagnose_dataset(config, progress, until)
        return
    if lerobot is not None:
        config = with_joints(config, lerobot, progress)
        folders = dataset_folders(config.dataset)
    diagnose_joints(config, folders, progress, until)


def diagnose_dataset(
    config: DiagnoseConfig, progress: DiagnosisProgress, until: float | None
) -> None:
    """Diagnose a dataset, until an instant [s] about, and print what was found."""
    if config.arm is not None:
        raise InvalidParameter(
            f"--arm needs a folder with a dataset of each joint; {config.dataset} has none in it"
        )
    dataset = read_dataset(config)
    model = start_model(config, dataset)
    out = make_folder(config.out, config.dataset, config.model)

    from tendon_newton.diagnosis.reporting.report import Origin
    from tendon_newton.workflows.diagnosing import diagnose_into
    from tendon_newton.workflows.importing import stated_gains

    progress.show_findings(dataset)
    progress.show(stated_gains(dataset.train, model))
    origin = Origin(dataset=config.dataset, command=shlex.join(["tendon-newton", *sys.argv[1:]]))
    budget = None if until is None else max(0.0, until - time.monotonic())
    diagnosis = diagnose_into(out, dataset, model, origin, progress=progress, budget=budget)
    if config.json:
        print((out / "diagnosis.json").read_text(encoding="utf-8"), end="")
        return
    print(summary(diagnosis))
    print("\n".join(["", *places(out, diagnosis)]))


def places(out: Path, diagnosis: Diagnosis) -> list[str]:
    """Say where the files of an answer are, and what to type next."""
    here = str(out)
    lines = [
        f"  report           {out / 'report.html'}",
        f"  extended model   {out / 'model.toml'}",
        f"  for programs     {out / 'diagnosis.json'}",
        f"  why, or why not  tendon-newton explain {shlex.quote(here)}",
    ]
    if diagnosis.separable:
        run = f"tendon-newton experiment {shlex.quote(here)} --out run.csv"
        lines.append(f"  to tell apart    {run}")
    return lines


def say_changes(config: DiagnoseConfig, against: Path, progress: DiagnosisProgress) -> None:
    """Hold the recordings against an earlier day, and tell what changed."""
    if any(option is not None for option in (config.hold_out, config.budget, config.arm)):
        raise InvalidParameter(
            "--against searches nothing: it takes no --hold-out, no --budget and no --arm"
        )
    refuse_lerobot_options(config)

    from tendon_newton.diagnosis.in_time.changes_report import answer_lines
    from tendon_newton.workflows.comparing_days import compare_days

    make_folder(config.out, config.dataset, against, config.model)
    days = compare_days(config.dataset, against, config.model, progress, config.out, config.mended)
    if config.json:
        print((config.out / "changes.json").read_text(encoding="utf-8"), end="")
        return
    print("", *answer_lines(days), sep="\n")
    print(f"\n  report          {config.out / 'changes.html'}")
    print(f"  model of today  {config.out / 'model.toml'}")


def lerobot_folder(dataset: Path) -> Path | None:
    """Return the folder of a LeRobotDataset, which may be named by its id; None for another."""
    from tendon_newton.data.importers.lerobot.hub import local_folder
    from tendon_newton.data.importers.lerobot.info import INFO

    folder = local_folder(str(dataset))
    return folder if (folder / INFO).is_file() else None


def with_joints(
    config: DiagnoseConfig, folder: Path, progress: DiagnosisProgress
) -> DiagnoseConfig:
    """Import a LeRobotDataset beside the results, and ask for its joints."""
    from tendon_newton.data.importers.lerobot import LeRobotUnits, read_lerobot
    from tendon_newton.workflows.importing import admit, mend, write_parts

    out = make_folder(config.out, folder, config.model) / RECORDINGS
    imported = read_lerobot(folder, LeRobotUnits(unit=config.unit, calibration=config.calibration))
    imported = admit(mend(imported) if config.mend else imported)
    reports = write_parts(imported, out, config.test)
    progress(f"a dataset of each of {len(reports)} joints is in {out}.")
    progress.show(one for one in imported.findings if one.recording == "all")
    config = replace(config, dataset=out)
    if config.hold_out is None and not all(report.split.test for report in reports.values()):
        progress(f"there is one episode: the last {LAST:.0%} of it only report the error.")
        return replace(config, hold_out=LAST)
    return config


def refuse_lerobot_options(config: DiagnoseConfig) -> None:
    """Refuse options that belong to a LeRobotDataset, and say what takes their place."""
    mending = ["tendon-newton", "doctor", str(config.dataset)]
    ways = {
        "unit": "is none",
        "calibration": "is none",
        "test": 'is none: its dataset.toml says which recordings of it have split = "test"',
        "mend": f"is none: {shlex.join([*mending, '--mend', f'{config.dataset}_mended'])}",
    }
    for option, way in ways.items():
        if getattr(config, option):
            raise InvalidParameter(
                f"--{option} belongs to a LeRobotDataset; {config.dataset} {way}"
            )


def diagnose_joints(
    config: DiagnoseConfig,
    folders: tuple[Path, ...],
    progress: DiagnosisProgress,
    until: float | None,
) -> None:
    """Diagnose each joint's servo, until an instant [s] about, and print what was found."""
    from tendon_newton.workflows.diagnosing_arm import (
        arm_lines,
        arm_mechanism,
        arm_table,
        diagnose_arm_into,
        error_lines,
        servo_lines,
    )

    make_folder(config.out, config.dataset, config.model)
    each = {folder.name: replace(config, dataset=folder) for folder in folders}
    datasets = {joint: read_dataset(own) for joint, own in each.items()}
    for joint, dataset in datasets.items():
        progress.show_findings(dataset, f"{joint}: ")
    progress.show_exchanges(datasets)
    answer = diagnose_arm_into(
        config.out,
        datasets,
        {joint: start_model(own, datasets[joint]) for joint, own in each.items()},
        None if config.arm is None else arm_mechanism(config.arm, config.out),
        shlex.join(["tendon-newton", *sys.argv[1:]]),
        progress=progress,
        until=until,
    )
    if config.json:
        files = {joint: config.out / joint / "diagnosis.json" for joint in answer.servos}
        table = {
            "joints": {joint: json.loads(file.read_bytes()) for joint, file in files.items()},
            "arm": None if answer.known is None else arm_table(answer, answer.known),
        }
        print(json.dumps(table, indent=1))
        return
    for joint, one in answer.servos.items():
        why = shlex.join(["tendon-newton", "explain", str(config.out / joint)])
        print(
            f"\n{joint}{summary(one)}\n\n  report  {config.out / joint / 'report.html'}"
            f"\n  why, or why not  {why}"
        )
    if answer.known is None:
        words = ["tendon-newton", "diagnose", str(config.dataset), "--out", str(config.out)]
        words += [] if config.hold_out is None else ["--hold-out", f"{config.hold_out:g}"]
        print(f"\nnext, with each servo under the arm's weight: {shlex.join(words)} --arm ASSET")
        return
    print("\n".join(["", *arm_lines(answer.known), *servo_lines(answer), *error_lines(answer)]))
    words = ["tendon-newton", "export", str(config.out), "--to", "mujoco"]
    words += ["--dataset", str(config.dataset)] * (config.hold_out is None)
    print(f"\nnext: {shlex.join([*words, '--out', f'{config.out}_mujoco'])}")


class DiagnosisProgress:
    """Tells what is being done, since when, and how much time is left.

    Args:
        start: Instant of the monotonic clock at which the command began [s].
    """

    def __init__(self, stream: TextIO, start: float) -> None:
        self.stream, self.start = stream, start

    def __call__(self, text: str) -> None:
        """Tell what comes next."""
        from tendon_newton.diagnosis.time_left import time_left

        elapsed = time.monotonic() - self.start
        left = time_left(text, elapsed) or ("" if text.endswith(".") else " ...")
        print(f"  {elapsed:4.0f} s  {text}{left}", file=self.stream, flush=True)

    def show_findings(self, dataset: Dataset, whose: str = "") -> None:
        """Tell what is wrong with the data, and whose, before anything is made of them."""
        from tendon_newton.diagnosis.reporting.report_tables import finding_rows

        for row in finding_rows(dataset.train, dataset.test)["findings"]:
            what = f"{whose}{row['severity']} in {row['channel']}"
            print(f"  {what}: {row['evidence']}; {row['consequence']}", file=self.stream)

    def show(self, findings: Iterable[Finding]) -> None:
        """Tell findings."""
        for one in findings:
            text = f"{one.severity} in {one.channel}: {one.evidence}; {one.consequence}"
            print(f"  {text}", file=self.stream)

    def show_exchanges(self, datasets: Mapping[str, Dataset]) -> None:
        """Tell which joints of an arm follow each other's commands."""
        from tendon_newton.diagnosis.accounts.checked_data import exchanges_between

        for one in exchanges_between(datasets):
            self.show([replace(one, channel=one.recording)])


def limit_cores(jobs: int | None) -> None:
    """Let simulations take so many cores; all of them by default."""
    from tendon_newton.scheduler import MOST_JOBS, THREADS_VARIABLE

    if jobs is None:
        return
    if not 1 <= jobs <= MOST_JOBS:
        raise InvalidParameter(f"--jobs must be 1 to {MOST_JOBS} cores; they are {jobs}")
    os.environ[THREADS_VARIABLE] = str(jobs)


def model_file(config: DiagnoseConfig) -> Path:
    """Return the model file to start from: the one that is named, or the dataset's own."""
    if config.model is not None:
        return config.model
    beside = config.dataset / "model.toml"
    if not beside.is_file():
        raise InvalidModelFile(
            f"{beside}: a diagnosis starts from a model; there is none. Name one with --model, or "
            "write this file: the verbs collect and import do, docs/model_file.md tells how"
        )
    return beside


def start_model(config: DiagnoseConfig, dataset: Dataset) -> Model:
    """Return the model to start from, for the benches of a dataset."""
    from tendon_newton.diagnosis.diagnosed_bench import open_model
    from tendon_newton.mechanisms.loading import load_mechanism

    file = model_file(config)
    benches = dict.fromkeys(recording.bench for recording in dataset.train)
    return open_model(file, [load_mechanism(bench) for bench in benches])


def read_dataset(config: DiagnoseConfig) -> Dataset:
    """Read the recordings, and cut those of a dataset that holds none out."""
    from tendon_newton.data.dataset import load_dataset
    from tendon_newton.identification.cutting import hold_out
    from tendon_newton.scheduler import core_count

    jobs = config.jobs or core_count()
    if config.hold_out is None:
        return load_dataset(config.dataset, jobs=jobs)
    if not 0.05 <= config.hold_out <= 0.8:
        raise InvalidParameter(f"--hold-out must be 0.05 to 0.8; it is {config.hold_out:g}")
    whole = load_dataset(config.dataset, require_test=False, jobs=jobs)
    if whole.test:
        raise InvalidParameter(
            f"--hold-out cuts recordings of a dataset that holds none out; {config.dataset} has "
            f'{len(whole.test)} with split = "test"'
        )
    train, test = hold_out(whole.train, config.hold_out)
    return replace(whole, train=train, test=test)


VERDICTS = {
    "no_gap": "no gap: what the model leaves is noise, as far as this data can tell",
    "explained": "explained: the named causes account for the gap",
    "partly_explained": "partly explained: the named causes are real, and structure remains",
    "unexplained": "unexplained: there is a gap, and no effect of the catalogue accounts for it",
}


def numbers_line(effect: NamedEffect, servos: int) -> str:
    """Return a cause with its numbers, their units and intervals."""
    from tendon_newton.data.parameters import with_unit
    from tendon_newton.diagnosis.report_words import with_owner

    numbers = ", ".join(
        f"{name} = {with_unit(f'{p.value:.4g}', p.unit)} [{p.ci95[0]:.4g}, {p.ci95[1]:.4g}]"
        for name, p in effect.parameters.items()
    )
    return f"  {with_owner(effect.name, servos):26s} {numbers}"


def summary(diagnosis: Diagnosis) -> str:
    """Return the result as a table for a terminal."""
    from tendon_newton.data.plain_numbers import estimate_text
    from tendon_newton.diagnosis.report_words import UNDECIDED
    from tendon_newton.diagnosis.reporting.report_doubts import doubts

    force = diagnosis.scale
    lines = ["", VERDICTS[diagnosis.verdict], ""]
    if not diagnosis.finished and diagnosis.verdict == "unexplained":
        lines[1] = f"UNFINISHED: {UNDECIDED}"
    elif diagnosis.start and diagnosis.verdict == "unexplained":
        lines[1] += ", beyond what the starting model has"
    elif not diagnosis.finished:
        lines[1:1] = ["UNFINISHED: the search was ended early, and causes may be missing. So far:"]
    if diagnosis.actuator is not None:
        lines.append(f"  {diagnosis.actuator.sentence}")
    for effect in diagnosis.effects:
        lines.append(numbers_line(effect, diagnosis.servos))
        if effect.indistinguishable_from:
            lines.append(
                f"  {'':26s} or {', '.join(effect.indistinguishable_from)}: not told apart"
            )
    for name, known in diagnosis.fitted.items():
        value, within = estimate_text(diagnosis.model.actuator.name, name, known)
        lines.append(f"  {'fitted ' + name:26s} {value} [{within}]")
    if diagnosis.suspected:
        lines += ["", "  suspected, and in the model because it predicts better with them:"]
    for effect in diagnosis.suspected:
        lines += [numbers_line(effect, diagnosis.servos), f"  {'':26s} {effect.reason}"]
    lines += [""] * bool(lines[-1]) + ["  held-out error           before      after"]
    for label, name, scale, unit in (
        (f"{diagnosis.angle_name}, RMS", "theta_rmse", 1e3, "mrad"),
        (f"{diagnosis.angle_name}, mean abs.", "theta_mae", 1e3, "mrad"),
        (f"{force.force_name}, RMS", "force_rmse", 1.0, force.force_unit),
    ):
        before, after = getattr(diagnosis.baseline, name), getattr(diagnosis.extended, name)
        if before and after is not None:  # an angle that was given leaves nothing
            lines.append(f"  {label:22s} {scale * before:8.4g}   {scale * after:8.4g} {unit}")
    if diagnosis.next_steps:
        lines += ["", "  what came closest, and what to do next:"]
        lines += [f"  - {step}" for step in diagnosis.next_steps]
    lines += [f"  note: {note}" for note in (*doubts(diagnosis), *diagnosis.notes)]
    return "\n".join(lines)
