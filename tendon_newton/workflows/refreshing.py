"""From the logs of a worn bench to a corrected model and a policy that knows it."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_hardware.control.goals import DWELL, stairs
from tendon_hardware.control.operator import Operator
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.deploy_log import policy_span, step_table
from tendon_newton import __version__
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.ledger import Ledger
from tendon_newton.data.files.origin import file_hash
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.data.files.together import together
from tendon_newton.data.formats.mcap_file import read_session
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.diagnosis.in_time.changes_report import CHANGES
from tendon_newton.diagnosis.reporting.report import Origin, write_report
from tendon_newton.diagnosis.result import write_diagnosis
from tendon_newton.effects import find_effect
from tendon_newton.errors import InvalidOutput, InvalidParameter
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.workflows.climbing import climbed, stair_levels
from tendon_newton.workflows.options import RefreshOptions
from tendon_train.policy.scoring.bench_climb import climb_on_bench
from tendon_train.policy.scoring.evaluation_scores import ClimbScore, draw_climbs, score
from tendon_train.policy.scoring.policy_evaluation import (
    Climb,
    RunnablePolicy,
    climb_stairs,
    reachable_error,
)
from tendon_train.policy.worlds.force_model import hashes
from tendon_train.refresh.drift import SUSPECTS, find_drift, growth, model_error, tune
from tendon_train.refresh.refresh_logs import (
    fitted_parts,
    log_files,
    logs_as_dataset,
    read_logs,
    taut_parts,
)
from tendon_train.refresh.refresh_outcome import (
    AGREES,
    Drift,
    TipFigure,
    headline,
    judge_drift,
    told_drift,
    write_page,
)
from tendon_train.refresh.retraining import find_training, retrain
from tendon_train.refresh.slip import SLIP, SLIPS, slip_since, taut_from, with_slip

POLICY_ENDINGS = (".onnx", ".pt")
"""Endings of the two files that a training writes of the same policy."""
CORRECTED = "simulation, corrected"
STEPS_OFF = 0.05
"""Mean distance [rad] from the goals of the stairs up to which a log's are the same: a policy's
step is seen up to 50 ms late."""


def refresh(options: RefreshOptions, operator: Operator) -> Drift:
    """Find the drift, correct the model, train on, and say what came of it.

    Args:
        operator: Told how it goes, and asked where a bench must be made ready.

    Raises:
        InvalidParameter: There is nothing to train.
        UnknownName: A suspect is no effect.
    """
    if options.iterations < 1:
        raise InvalidParameter(f"iterations must be 1 or more; they are {options.iterations}")
    for name in options.suspects:
        find_effect(name)
    ledger = open_ledger(options, make_folder(options.out, options.model))
    for log in log_files((*options.reference, *options.logs)):
        if not is_of(options.policy, log):
            operator.tell(
                f"another policy than {options.policy} drove the bench in {log}: the log tells "
                "of the bench, but its tip error is not that of the old policy"
            )
    drift = find_drift_in_logs(options, ledger, operator)
    operator.announce(f"\n{headline(drift)}")
    for cause in drift.causes:
        operator.announce(f"  {cause.name:26s} {', '.join(cause.numbers)}   ({cause.words})")
    figures: list[TipFigure] = []
    picture = None
    if drift.verdict != AGREES or options.anyway:
        correct_model(options, drift, ledger, operator)
        train_policy_on(options, ledger, operator)
        figures, picture = compare_policies(options, ledger, operator)
    write_outcome(options, drift, figures, ledger, picture, operator)
    return drift


def open_ledger(options: RefreshOptions, out: Path) -> Ledger:
    """Return how far an earlier call came; other inputs are refused."""

    def by_path(paths: tuple[Path, ...]) -> dict[str, str]:
        return {str(path): file_hash(path) for path in log_files(paths)}

    inputs = {
        "logs": by_path(options.logs),
        "reference": by_path(options.reference),
        "model": hashes(options.model)[options.model.name],
        "policy": file_hash(find_training(options.policy).checkpoint),
        "suspects": options.suspects,
        "changes": None if options.changes is None else file_hash(options.changes / CHANGES),
        "port": options.port,
    }
    return Ledger(out / "refresh.json", inputs)


def find_drift_in_logs(options: RefreshOptions, ledger: Ledger, operator: Operator) -> Drift:
    """Hold the logs against the model, unless what changed is known."""
    if (done := ledger.done("drift")) is not None:
        return CheckedTable(done, str(ledger.path), InvalidOutput).record(Drift)
    changes = options.changes
    drift = find_wear(options, operator) if changes is None else told_drift(changes)
    ledger.finish("drift", asdict(drift))
    return drift


def find_wear(options: RefreshOptions, operator: Operator) -> Drift:
    """Try kinds of wear on the logs."""
    model, logs = load_model(options.model), read_logs(options.logs, policy_span)
    later = fitted_parts(logs)
    suspects = options.suspects or tuple(SUSPECTS)
    folder = make_folder(options.out / "diagnosis")
    operator.announce("reading benches ...")
    dataset = logs_as_dataset(options.logs[0], logs, taut_from(later, model))
    reference_error, grown, slip = None, None, None
    if options.reference:
        reference_logs = read_logs(options.reference, policy_span)
        reference = logs_as_dataset(options.out, reference_logs)
        reference_error = model_error(reference.test, model)
        grown = growth(dataset, reference, model)
        slip = slip_since(fitted_parts(reference_logs), later) if SLIP in suspects else None
    diagnosis, evidence = find_drift(
        dataset, model, suspects=suspects, progress=lambda text: operator.announce(f"{text} ...")
    )
    with together():
        write_model(folder / "model.toml", diagnosis.model)
        write_report(folder / "report.html", diagnosis, evidence, Origin())
        write_diagnosis(folder / "diagnosis.json", diagnosis)
    return judge_drift(diagnosis, reference_error, grown=grown, slip=slip)


def correct_model(
    options: RefreshOptions, drift: Drift, ledger: Ledger, operator: Operator
) -> None:
    """Put what was found into the model; where nothing was, fit all its numbers to the logs."""
    if ledger.done("model") is not None:
        return
    if options.changes is not None:
        write_model(options.out / "model.toml", load_model(options.changes / "model.toml"))
        ledger.finish("model", {"fitted": "told"})
        return
    operator.announce("correcting the model ...")
    logs = fitted_parts(read_logs(options.logs, policy_span))
    model = load_model(options.model)
    if any(cause.name in SLIPS for cause in drift.causes):
        reference = read_logs(options.reference, policy_span) if options.reference else ()
        corrected, how = with_slip(logs, model, fitted_parts(reference)), "slip"
    elif drift.causes:  # all else was right when the bench was new
        corrected, how = load_model(options.out / "diagnosis" / "model.toml"), "cause"
    else:
        corrected, how = tune(taut_parts(logs, taut_from(logs, model)), model).model, "all"
    write_model(options.out / "model.toml", corrected)
    ledger.finish("model", {"fitted": how})


def train_policy_on(options: RefreshOptions, ledger: Ledger, operator: Operator) -> None:
    """Train the policy on."""
    done = ledger.done("training")
    if done and done["iterations"] == options.iterations and new_policy(options).exists():
        return
    begin, diagnosed = time.monotonic(), options.out / "diagnosis" / "diagnosis.json"
    exported = retrain(
        find_training(options.policy),
        options.out / "model.toml",
        make_folder(options.out / "training"),
        worn=(str(diagnosed),) if ledger.done("model") == {"fitted": "cause"} else (),
        iterations=options.iterations,
        device=options.device,
        report=lambda progress: operator.announce(f"  {progress.text}"),
    )
    spent = time.monotonic() - begin + (done or {"seconds": 0.0})["seconds"]
    ledger.finish(
        "training",
        {
            "iterations": options.iterations,
            "seconds": spent,
            "samples": exported.card.training.samples,
        },
    )


def compare_policies(
    options: RefreshOptions, ledger: Ledger, operator: Operator
) -> tuple[list[TipFigure], Path]:
    """Measure the old and the new policy, before and after, simulated and on the bench."""
    mechanism = load_mechanism(find_training(options.policy).config.environment.finger)
    climbs = [*simulated(options), *logged(options), *deployed_anew(options, ledger, operator)]
    scores: list[ClimbScore] = [score(c, reachable_error(mechanism, c.goal)) for c in climbs]
    alike = [k for k, c in enumerate(climbs) if c.time[-1] < 1.1 * climbs[0].time[-1]]
    picture = draw_climbs(
        [climbs[k] for k in alike], [scores[k] for k in alike], options.out / "climb.png"
    )
    figures = [TipFigure(policy=s.policy, where=s.place, rmse=s.rmse) for s in scores]
    ledger.finish("figures", [asdict(figure) for figure in figures])
    keep_if_better(options, climbs, scores, ledger)
    return figures, picture


def keep_if_better(
    options: RefreshOptions, climbs: Sequence[Climb], scores: Sequence[ClimbScore], ledger: Ledger
) -> None:
    """Take the files of the new policy away unless it misses less than the old one.

    Where both followed the stairs on the bench as it is now, that decides; else the simulation.
    """
    goals, found = stairs(DWELL), dict[str, dict[str, list[float]]]()
    for climb, judged in zip(climbs, scores, strict=True):
        asked = [goals.value(instant) for instant in climb.time]
        where = CORRECTED if climb.place == CORRECTED else climb.place.split(": ")[0]
        if np.mean(np.abs(climb.goal - asked)) < STEPS_OFF:
            found.setdefault(where, {}).setdefault(climb.policy, []).append(judged.rmse)
    both = [where for where, own in found.items() if {"old", "new"} <= own.keys()]
    where = next((each for each in both if each != CORRECTED), CORRECTED)
    old, new = (float(np.mean(found[where][name])) for name in ("old", "new"))
    ledger.finish("better", {"where": where, "old": old, "new": new, "written": new < old})
    if new >= old:
        for ending in POLICY_ENDINGS:
            new_policy(options).with_suffix(ending).unlink(missing_ok=True)


def simulated(options: RefreshOptions) -> list[Climb]:
    """Let both policies follow the stairs of goals, on the old and on the corrected model."""
    trained_in = find_training(options.policy).config.environment
    levels = stair_levels(trained_in.rate, DWELL)
    old, new = options.policy, new_policy(options)
    climbs: list[Climb] = []
    for name, file, force, place in (
        ("old", old, options.model, "simulation, as the model had it"),
        ("old", old, options.out / "model.toml", CORRECTED),
        ("new", new, options.out / "model.toml", CORRECTED),
    ):
        loaded = load_policy(file)
        policy = RunnablePolicy(name=name, card=loaded.card, run=loaded.run)
        worlds = replace(trained_in, force=str(force), worlds=1, randomise=("none",))
        climbs += [replace(c, place=place) for c in climb_stairs([policy], levels, worlds)]
    return climbs


def logged(options: RefreshOptions) -> list[Climb]:
    """Read what the old policy did on the bench, before and now."""
    return [
        climb_of(options, "old" if is_of(options.policy, log) else "another", log, when)
        for when, logs in (("before", options.reference), ("now", options.logs))
        for log in log_files(logs)
    ]


def new_policy(options: RefreshOptions) -> Path:
    """Return the file of the policy that was trained on."""
    return options.out / "training" / "policy.onnx"


def is_of(policy: Path, log: Path) -> bool:
    """Tell whether a policy drove the bench in a log, by the log's hash; without a hash it did."""
    found = read_session(log).get("policy.sha256") if log.suffix == ".mcap" else None
    files = [file for ending in POLICY_ENDINGS if (file := policy.with_suffix(ending)).is_file()]
    return found is None or found in [file_hash(file) for file in files]


def deployed_anew(options: RefreshOptions, ledger: Ledger, operator: Operator) -> list[Climb]:
    """Let the new policy follow the stairs on the bench, once for each length of its training."""
    if options.port is None:
        return []
    done = ledger.done("bench")
    if done is None or done["iterations"] != options.iterations:
        log = climbed(options, new_policy(options), options.out / "deployments", operator)
        ledger.finish("bench", {"iterations": options.iterations, "log": str(log)})
    return [climb_of(options, "new", Path(ledger.done("bench")["log"]), "now")]


def climb_of(options: RefreshOptions, policy: str, log: Path, when: str) -> Climb:
    """Read from a log how a policy followed its goals."""
    mechanism = load_mechanism(find_training(options.policy).config.environment.finger)
    radius = load_policy(options.policy).card.spool_radius
    climb = climb_on_bench(policy, log, step_table(log), mechanism, radius)
    return replace(climb, place=f"{climb.place}, {when}: {log.name}")


def write_outcome(
    options: RefreshOptions,
    drift: Drift,
    figures: list[TipFigure],
    ledger: Ledger,
    picture: Path | None,
    operator: Operator,
) -> None:
    """Write the page and say where everything is."""
    facts = {
        "logs": ", ".join(map(str, options.logs)),
        "model": str(options.model),
        "policy": str(options.policy),
        "program": f"tendon-newton {__version__}",
    }
    trained = ledger.done("training")
    if trained is not None:
        facts["training"] = (
            f"{trained['iterations']} iterations, {trained['samples']:,} steps, "
            f"{trained['seconds']:.0f} s on {options.device}"
        )
    judged = ledger.done("better") if figures else None
    if judged is not None:
        facts["policy that is better"] = better_text(judged)
    write_page(options.out / "refresh.html", drift, figures, facts, picture)
    for figure in figures:
        operator.announce(f"  {figure.policy:4s} {1e3 * figure.rmse:6.1f} mm RMS   {figure.where}")
    operator.announce(f"\nwrote {options.out / 'refresh.html'}")
    if trained is not None:
        operator.announce(f"  corrected model  {options.out / 'model.toml'}")
        if judged is None or judged["written"]:
            operator.announce(f"  new policy       {new_policy(options)}")
        else:
            operator.announce(f"  no new policy: {better_text(judged)}")


def better_text(judged: Mapping[str, Any]) -> str:
    """Return in words which policy is better, and where that was seen."""
    old, new = 1e3 * judged["old"], 1e3 * judged["new"]
    figures = f"({new:.1f} mm, the old one {old:.1f} mm; {judged['where']})"
    if judged["written"]:
        return f"the new one {figures}"
    return f"the new one misses as much or more {figures}, so it is not written; keep the old one"
