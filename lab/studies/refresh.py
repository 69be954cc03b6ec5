"""Ten worn benches: what a refresh gains, beside training anew and doing nothing.

``python -m lab.studies.refresh --out DIR --arms diagnosed --seeds 0``

Each unit of the virtual bench is recorded and diagnosed, and a policy is trained on its diagnosis,
as `lab.studies.diagnosed_policies` does it, with which a DIR can be shared: its words, such as
``--arms`` and ``--seeds``, are understood here, and its jobs are done too. Then the gear of each
second unit runs dry, and the spool of the others slips. The policy climbs there, and follows goals
at random; `refresh` goes from these logs to another policy. Beside it stand the policy that was
there, one that is trained anew on a diagnosis of the worn bench, the data sheet's, and the packaged
one. On each unit as it was, `refresh` is asked as well, and should say nothing. ``worn.json`` and
``worn.md`` have the result.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np
from scipy.stats import ttest_rel

from lab.studies.climbs import climb, file_of
from lab.studies.diagnosed_policies import (
    OURS,
    PACKAGED,
    Study,
    Training,
    command_of,
    diagnosed,
    jobs_of,
    reader,
    still_error,
    study_of,
    write_table,
)
from lab.studies.job_graph import Job, Places, failures, run
from lab.studies.units import read
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import git_commit
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.workflows.deployment import drive
from tendon_newton.workflows.options import DeployOptions, RefreshOptions
from tendon_newton.workflows.packaged_policies import policy_file
from tendon_newton.workflows.refreshing import find_drift_in_logs, open_ledger, refresh
from tests.hardware.silent_operator import SilentOperator

STATES = ("friction", "spool")  # Wear of each second unit, and of the others
NAMES: dict[str, tuple[str, ...]] = {
    "new": (),
    "friction": (
        "coulomb_friction", "viscous_friction", "load_dependent_friction", "holding_friction",
    ),
    "spool": ("tendon_slack", "position_offset"),
}  # fmt: skip
"""Names that say what is the matter."""
DURATION = 30.0  # Length of a log of random goals [s]
STAIRS = 16.5  # Length of the paper's stairs [s]
BEFORE, WORN, REFRESHED, KEPT, ANEW, SHEET = (
    "its policy, before the wear", "its policy, nothing done", "refreshed", "refreshed, if better",
    "trained anew", "data sheet",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Bench:
    """A unit, how it wears, and where all about it stands."""

    unit: str
    state: str  # ``friction``, ``spool``, or ``new`` for one that does not wear
    out: Path
    iterations: int

    @property
    def folder(self) -> Path:
        """Where its refresh stands."""
        return self.out / f"refresh_{self.unit}_{self.state}"

    @property
    def policy(self) -> Path:
        """The policy that drives it."""
        return Training(arm="diagnosed", unit=self.unit, seed=0, out=self.out).policy

    @property
    def logs(self) -> tuple[Path, Path, Path]:
        """Folders of its logs: stairs before, stairs now, goals at random now."""
        own = self.out / f"logs_{self.unit}"
        return (
            own / f"before_{self.state}",
            own / f"stairs_{self.state}",
            own / f"goals_{self.state}",
        )

    def options(self, device: str) -> RefreshOptions:
        """Return what its refresh is asked."""
        before, stairs, goals = self.logs
        return RefreshOptions(
            logs=(stairs, goals), reference=(before,), policy=self.policy, out=self.folder,
            model=self.out / f"answer_{self.unit}" / "model.toml", iterations=self.iterations,
            device=device, port=f"virtual:finger:{self.unit}:{self.state}",  # type: ignore[arg-type]
            faster_than_real_time=True,
        )  # fmt: skip


def fly(policy: Path, folder: Path, port: str, goals: str, duration: float) -> Path:
    """Deploy once, in lockstep, and return the log; a log that is there is taken."""
    logs = sorted(folder.glob("*.mcap"))
    if not logs:
        options = DeployOptions(
            policy=policy, port=port, goals=goals, duration=duration, out=folder,
            faster_than_real_time=True,
        )  # fmt: skip
        drive(options, SilentOperator())
        logs = sorted(folder.glob("*.mcap"))
    return logs[0]


def random_goals(path: Path, seed: int) -> str:
    """Write goals that are held for one to two and a half seconds, and return the file's name."""
    rng = np.random.default_rng(seed)
    path.parent.mkdir(parents=True, exist_ok=True)
    instants = np.cumsum(np.r_[0.0, rng.uniform(1.0, 2.5, 40)])
    values = rng.uniform(0.0, 0.5 * pi, 41)
    lines = [f"{t:.3f} {a:.4f}" for t, a in zip(instants, values, strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def notice(bench: Bench) -> str:
    """Let the policy drive a bench before and after its wear, and say what has worn."""
    quiet_warp()
    before, stairs, goals = bench.logs
    port = f"virtual:finger:{bench.unit}:{bench.state}"
    fly(bench.policy, before, f"virtual:finger:{bench.unit}", "stairs", STAIRS)
    fly(bench.policy, stairs, port, "stairs", STAIRS)
    asked = random_goals(goals / "goals.txt", 2 * int(bench.unit) + 1)
    fly(bench.policy, goals, port, asked, DURATION)
    options = bench.options("cpu")
    bench.folder.mkdir(parents=True, exist_ok=True)
    ledger = open_ledger(options, bench.folder)
    drift = find_drift_in_logs(options, ledger, SilentOperator())
    (bench.folder / "noticed").write_text(drift.verdict)
    return f"unit {bench.unit} {bench.state}: {drift.verdict}, {[c.name for c in drift.causes]}"


def restore(bench: Bench, device: str) -> str:
    """Go on to a refreshed policy; where nothing was noticed nothing is trained."""
    quiet_warp()
    refresh(bench.options(device), SilentOperator())
    judged = stages(bench.folder).get("better", {})
    (bench.folder / "restored").touch()
    return f"unit {bench.unit} {bench.state} is refreshed: {judged}"


def stages(folder: Path) -> dict[str, Any]:
    """Return what a refresh has come to."""
    path = folder / "refresh.json"
    return read(path)["stages"] if path.exists() else {}


def benches_of(study: Study, iterations: int) -> list[Bench]:
    """Return each unit worn, and as it was."""
    return [
        Bench(unit=unit, state=state, out=study.out, iterations=iterations)
        for number, unit in enumerate(study.units)
        for state in (STATES[number % 2], "new")
    ]


def worn_study(study: Study) -> Study:
    """Return the study of policies that are trained anew on worn units."""
    units = tuple(f"{b.unit}_{b.state}" for b in benches_of(study, 1) if b.state != "new")
    return replace(
        study, units=units, seeds=study.seeds[:1], arms=("diagnosed", "ranges"), elsewhere=False
    )


def jobs_of_refresh(study: Study, threads: int) -> list[Job]:
    """Return all jobs, those of more worth first: one seed, what is worn, the other seeds."""
    first = replace(study, seeds=study.seeds[:1])
    jobs = [*jobs_of(first, threads), *jobs_of(worn_study(study), threads)]
    for bench in benches_of(study, study.recipe.iterations):
        noticed = bench.folder / "noticed"
        needs = (bench.policy, diagnosed(bench.unit, study.out))
        jobs.append(Job(makes=noticed, needs=needs, work=notice, what=(bench,), wanted=True))
        if bench.state != "new":
            climbed = (bench.policy, f"{bench.unit}_{bench.state}", study.out / "climbs")
            jobs += [
                Job(makes=bench.folder / "restored", needs=(noticed,), work=restore,
                    what=(bench,), on_device=True, wanted=True),
                Job(makes=file_of(*climbed), needs=(bench.policy,), work=climb, what=(climbed,),
                    wanted=True, brief=True),
            ]  # fmt: skip
    return [*jobs, *jobs_of(study, threads)]


def write_worn(study: Study) -> None:
    """Write the tip errors of all benches [mm], and what was noticed."""
    errors: dict[str, dict[str, float]] = {}
    noticed: dict[str, dict[str, Any]] = {}
    for bench in benches_of(study, 1):
        name, found = f"{bench.unit}_{bench.state}", stages(bench.folder)
        if "drift" in found:
            causes = [(c["name"], *c["rivals"]) for c in found["drift"]["causes"]]
            right = bool(causes) and bool({*causes[0]} & {*NAMES[bench.state]})
            noticed[name] = {"verdict": found["drift"]["verdict"], "named": causes, "right": right}
        if bench.state != "new":
            for arm, error in errors_on(bench, found).items():
                errors.setdefault(arm, {})[name] = round(error, 3)
    still, restored = still_error(), errors.get(KEPT, {})
    lines = ["| policy on the worn bench | benches | tip error [mm]: mean (range) | p |",
             "| --- | --- | --- | --- |"]  # fmt: skip
    for arm, own in errors.items():
        both = sorted(own.keys() & restored.keys())
        one, other = ([errors[b] for b in both] for errors in (own, restored))
        p = float(ttest_rel(one, other).pvalue) if len(both) > 1 else np.nan
        told = f"{mean(own.values()):.1f} ({min(own.values()):.1f} to {max(own.values()):.1f})"
        lines.append(f"| {arm} | {len(own)} | {told} | {p:.1g} |")
    lines.append(f"| a finger that stands still | | {still:.1f} | |")
    kept = {
        "command": command_of(study.out),
        "commit": git_commit(), "still_mm": still, "tip_error_mm": errors, "noticed": noticed,
        "failed": failures(study.out),
    }  # fmt: skip
    write_json(study.out / "worn.json", kept)
    (study.out / "worn.md").write_text("\n".join(lines) + "\n")


def errors_on(bench: Bench, found: Mapping[str, Any]) -> dict[str, float]:
    """Return what each policy misses on a worn bench [mm], as far as it climbed there."""
    errors = {
        arm: 1e3 * read(path)["rmse"] for arm, path in climbs_of(bench).items() if path.exists()
    }
    if (bench.folder / "restored").exists() and WORN in errors:
        judged = found.get("better")  # nothing where no wear was noticed
        new = 1e3 * judged["new"] if judged else errors[WORN]
        errors[REFRESHED] = new
        errors[KEPT] = new if judged and judged["written"] else errors[WORN]
    return errors


def climbs_of(bench: Bench) -> dict[str, Path]:
    """Return the file of each climb that is compared."""
    worn, folder = f"{bench.unit}_{bench.state}", bench.out / "climbs"
    anew = Training(arm="diagnosed", unit=worn, seed=0, out=bench.out)
    return {
        BEFORE: file_of(bench.policy, bench.unit, folder),
        WORN: file_of(bench.policy, worn, folder),
        ANEW: file_of(anew.policy, worn, folder),
        SHEET: file_of(replace(anew, arm="ranges").policy, worn, folder),
        PACKAGED: file_of(policy_file(Path(OURS)), worn, folder),
    }


def main() -> None:
    """Do what is missing, and write the tables."""
    words = reader(__doc__).parse_args()
    study = study_of(words)
    places = Places.of(words.devices, words.each, words.cores, words.minutes)

    def write_tables() -> None:
        write_table(study)
        write_worn(study)

    run(jobs_of_refresh(study, words.threads), places, words.out, write_tables)
    write_tables()
    for name in ("table.md", "worn.md"):
        print((words.out / name).read_text())


if __name__ == "__main__":
    main()
