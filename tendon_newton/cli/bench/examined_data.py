"""Datasets in `doctor`: a row for each joint or recording, what to do about each, and as JSON."""

from __future__ import annotations

import json
import shlex
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyro

from tendon_newton.cli.terminal import VERDICT_COLOURS, coloured
from tendon_newton.errors import InvalidParameter

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tendon_newton.data.checks.bench_checks import BenchFacts
    from tendon_newton.data.checks.finding import Finding
    from tendon_newton.data.importers.joint_examination import Examination
    from tendon_newton.data.importers.own import OwnDataset
    from tendon_newton.data.recording import Recording

SHOWN = 3  # Recordings of a kind of finding whose evidence is printed.
OWN_FILE = "dataset.toml"
MARKS = (OWN_FILE, "meta/info.json")  # Files by which a dataset's folder is known.


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What somebody asks of recorded data."""

    dataset: tyro.conf.Positional[tuple[str, ...]] = ()
    """Folders of datasets, or ids of LeRobotDatasets; no bench is looked at then. With --against
    one recording of a dataset, or the dataset."""
    mend: Path | None = None
    """For a dataset of ours: new folder for it with all mends that no reader would do otherwise."""
    json: bool = False  # For datasets: print findings and numbers for programs and nothing else.
    unit: str | None = None
    """For a dataset: what its joints are in, rad, deg or percent; a percent is taken for a degree
    where nobody says so."""
    calibration: Path | None = None
    """For a dataset: the arm's calibration file, which says what 100 percent are."""


def examine_data(config: Asked) -> bool:
    """Examine datasets one after the other; tell whether all are sound."""
    from tendon_newton.data.dataset import dataset_folders
    from tendon_newton.data.importers.lerobot.hub import local_folder

    tables: list[dict[str, Any]] = []
    named = dict.fromkeys(folder_of(local_folder(name)) for name in config.dataset)
    for folder in named:
        parts = dataset_folders(folder)
        seen: dict[str, OwnDataset] = {}
        for part in parts or (folder,):
            if (parts or len(named) > 1) and not config.json:
                print(f"{part}:")
            inside = config.mend if config.mend is None or not parts else config.mend / part.name
            tables.append(examine_one(replace(config, mend=inside), part, seen))
        if len(parts) > 1:
            tables.append(examine_together(config, folder, seen))
    if config.json:
        print(json.dumps({"schema": 1, "datasets": tables}, indent=1))
    return all(table["sound"] for table in tables)


def folder_of(path: Path) -> Path:
    """Return the folder of a dataset of which a file was named, as a hook of pre-commit does."""
    if not path.is_file():
        return path
    above = (folder for folder in path.parents if any((folder / x).is_file() for x in MARKS))
    return next(above, path)


def examine_one(config: Asked, folder: Path, seen: dict[str, OwnDataset]) -> dict[str, Any]:
    """Examine one dataset; one of our own is kept by its folder's name."""
    from tendon_newton.data.dataset import refuse_other_folder

    if not any((folder / mark).is_file() for mark in MARKS):
        refuse_other_folder(folder)
        absent = "" if folder.exists() else ": no such folder"
        raise InvalidParameter(f"{folder}: a dataset is a folder with {' or '.join(MARKS)}{absent}")
    if (folder / OWN_FILE).is_file():
        return {"dataset": str(folder), **examine_own(config, folder, seen)}
    return {"dataset": str(folder), **examine_lerobot(config, folder)}


def examine_together(
    config: Asked, folder: Path, datasets: dict[str, OwnDataset]
) -> dict[str, Any]:
    """Examine the joints of an arm beside each other, and print a row for each."""
    from tendon_newton.data.importers.arm_folder import examine_arm

    seen = examine_arm(datasets)
    if not config.json:
        print(f"{folder}:")
        if seen is None:
            print(
                "      not held against each other: no joints of an arm that were logged together"
            )
        else:
            show_joints(seen)
    return {"dataset": str(folder), "format": "arm", **joint_tables(seen)}


def examine_lerobot(config: Asked, folder: Path) -> dict[str, Any]:
    """Examine a LeRobotDataset, print a row for each joint and what to type next."""
    from tendon_newton.data.importers.lerobot import LeRobotUnits
    from tendon_newton.data.importers.lerobot.lerobot_examination import examine_dataset

    if config.mend is not None:
        raise InvalidParameter(
            f"--mend writes datasets of our own format; {folder} is none: `import lerobot` and "
            "`diagnose` mend it with --mend"
        )
    units = LeRobotUnits(unit=config.unit, calibration=config.calibration)
    seen = examine_dataset(folder, units)
    if not config.json:
        show_joints(seen)
        show_next(config, folder, seen)
    return {"format": "lerobot", **joint_tables(seen)}


def show_joints(seen: Examination) -> None:
    """Print a row for each joint, and below it what to do."""
    from tendon_newton.data.importers.joint_examination import HEADINGS

    width = max(len("joint"), *(len(joint.joint) for joint in seen.joints))
    print(f"      {'joint':{width}}  {HEADINGS}")
    for joint in seen.joints:
        print(f"{verdict(sound=not joint.faults)} {joint.joint:{width}}  {joint.text}")
        show_kinds(joint.faults, width)
    show_kinds(seen.faults, width)
    failed = sum(bool(joint.faults) for joint in seen.joints)
    beside = " and more, as said" if seen.faults and failed else ""
    beside = ", but the recordings are" if seen.faults and not failed else beside
    print(f"{failed or 'none'} of {len(seen.joints)} joints to mend{beside}")


def verdict(*, sound: bool) -> str:
    """Return the word for what is sound or not, in its colour."""
    word = "good" if sound else "fix"
    return coloured(f"{word:5}", VERDICT_COLOURS[word])


def show_kinds(findings: Iterable[Finding], width: int) -> None:
    """Print each kind of finding once: what to do, and where."""
    from tendon_newton.data.checks.finding import kinds_of, what_follows

    for group in kinds_of(findings):
        where = [one for one in group[:SHOWN] if one.recording != "all"]
        told = "; ".join(
            f"{Path(one.recording).stem}: {one.evidence}" if one in where else one.evidence
            for one in group[:SHOWN]
        )
        more = f"; and {len(group) - SHOWN} more" if len(group) > SHOWN else ""
        print(f"      {'':{width}}  -> {told}{more}: {what_follows(group[0])}")


def show_next(config: Asked, folder: Path, seen: Examination) -> None:
    """Print the command that diagnoses a LeRobotDataset, mended where that is safe."""
    words = ["tendon-newton", "diagnose", str(folder), "--out", "arm_diagnosis"]
    if config.unit or not seen.in_radians:
        words += ["--unit", config.unit or "deg"]
    if config.calibration is not None:
        words += ["--calibration", str(config.calibration)]
    words += ["--mend"] * any(one.safe for joint in seen.joints for one in joint.faults)
    print(f"next: {shlex.join(words)}")
    if config.unit is None and "--unit" in words:
        print("      or --unit percent --calibration FILE, where the arm was recorded so")


def joint_tables(seen: Examination | None) -> dict[str, Any]:
    """Return an examination for programs, or that there is none; angles in rad, times in s."""
    if seen is None:
        return {"sound": True, "joints": [], "findings": []}
    joints = [
        {
            "joint": joint.joint,
            "sound": not joint.faults,
            "following": None if joint.following is None else asdict(joint.following),
            "offsets": joint.offsets,
            "held_share": joint.held_share,
            "missing_rows": joint.dropped,
            "late_rows": joint.late,
            "findings": [asdict(one) for one in joint.faults],
        }
        for joint in seen.joints
    ]
    return {"sound": seen.sound, "joints": joints, "findings": [asdict(one) for one in seen.faults]}


def examine_own(config: Asked, folder: Path, kept: dict[str, OwnDataset]) -> dict[str, Any]:
    """Examine a dataset of our own format, print what was found, and write it mended."""
    from tendon_newton.data.checks.finding import findings_text
    from tendon_newton.data.importers.own import read_own, write_mended

    if config.unit is not None or config.calibration is not None:
        raise InvalidParameter(
            f"{folder}: --unit and --calibration are for LeRobotDatasets; this one is in SI units"
        )
    seen = kept[folder.name] = read_own(folder, known_bench, mend=config.mend is not None)
    if config.mend is not None:
        write_mended(folder, seen, config.mend)
    findings = (*seen.findings, *against_stated(folder, (*seen.train, *seen.test)))
    wrong = [one for one in findings if one.severity == "defect"]
    if not config.json:
        lines = findings_text(findings, SHOWN)[1:]
        print(*lines, *[""] * bool(lines), sep="\n", end="\n" * bool(lines))
        count = len(seen.train) + len(seen.test)
        print(f"{verdict(sound=not wrong)} {folder}: {count} recordings", end="")
        print(f", {len(wrong)} defects" if wrong else "")
        if config.mend is not None:
            print(f"mended: {config.mend}")
        elif any(one.safe for one in wrong):
            words = ["tendon-newton", "doctor", str(folder), "--mend", f"{folder}_mended"]
            print(f"next: {shlex.join(words)}")
    return {"format": "own", "sound": not wrong, "findings": [asdict(one) for one in findings]}


def against_stated(folder: Path, recordings: Sequence[Recording]) -> Sequence[Finding]:
    """Return what recordings contradict in the model beside them; nothing in a light install."""
    try:
        from tendon_newton.data.model_file import load_model
        from tendon_newton.workflows.importing import stated_gains

        stated = folder / "model.toml"
        return stated_gains(recordings, load_model(stated)) if stated.is_file() else ()
    except ModuleNotFoundError:
        return ()


def known_bench(recording: Recording) -> BenchFacts | None:
    """Return what is known of a recording's bench; None where no simulator is installed."""
    try:
        from tendon_newton.device_code.quiet import quiet_warp
        from tendon_newton.workflows.importing import known_bench as facts

        quiet_warp()
        return facts(recording)
    except ModuleNotFoundError:  # in a light install, which reads recordings alone
        return None
