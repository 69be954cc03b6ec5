"""Go from the logs of a worn bench to a corrected model and a policy that knows it, unattended.

  tendon-newton refresh deployments --model model.toml --policy learned/policy.onnx --out refreshed

The logs are those of `tendon-newton deploy`. They are held against the model that fitted the bench:
has it drifted, and what is it? If it has, what was found goes into the model, and the policy is
trained on from its last checkpoint. --policy is a file that `train-policy` wrote, with its
policy.json and checkpoints beside it.

With logs of the time when the bench was new, so that old and new can be compared; and with a bench
on which the new policy is tried:
  tendon-newton refresh deployments/policy_4.mcap --reference deployments/policy_0.mcap
  --model model.toml --policy learned/policy.onnx --port virtual:finger:3:spool --out refreshed

OUT gets diagnosis/ (what `diagnose` writes), model.toml, training/policy.onnx, refresh.json and
refresh.html, one page. The same command goes on where it was interrupted; more --iterations go on
with a finished training.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

if TYPE_CHECKING:
    from train.policy.scoring.evaluation import Climb
    from train.policy.scoring.evaluation_scores import ClimbScore
    from train.refresh.ledger import Ledger
    from train.refresh.outcome import Drift, TipFigure


@dataclass(frozen=True, kw_only=True)
class RefreshConfig:
    """Correct a model and its policy from the logs of deployments."""

    logs: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Folders of deployments, or logs that stand in one; the last third of each is held out."""
    model: Path
    """Model file that fitted the bench."""
    policy: Path
    """Policy that is to be trained on, in the folder of its training."""
    out: Path
    """Folder for the results; made if it is not there."""
    reference: tuple[Path, ...] = ()
    """Logs of the same policy from the time when the model fitted; with them, how far a spool has
    slipped is found to some hundredths of a radian."""
    suspects: tuple[str, ...] = ()
    """Effects that may be named; by default all kinds of wear."""
    iterations: int = 100
    """Rounds of acting and learning of the new policy."""
    device: Literal["cpu", "cuda"] = "cpu"
    """Where it is trained."""
    anyway: bool = False
    """Train on even where no drift was found."""
    port: str | None = None
    """Serial port of the bench, or virtual:finger:3:spool: the new policy climbs stairs there."""
    load_cell_port: str | None = None
    """Serial port of the load cell of that bench."""
    calibration: Path | None = None
    """Calibration of that load cell."""
    faster_than_real_time: bool = False
    """Whether a virtual bench runs as fast as it can."""


def main(config: RefreshConfig) -> None:
    """Find the drift, correct the model, train on, and say what came of it."""
    from tendon_newton.cli.output import make_folder
    from tendon_newton.device_code.quiet import quiet_warp
    from tendon_newton.errors import InvalidParameter

    quiet_warp()

    from tendon_newton.effects import find_effect
    from train.refresh.outcome import AGREES, headline

    if config.iterations < 1:
        raise InvalidParameter(f"iterations must be 1 or more; they are {config.iterations}")
    for name in config.suspects:
        find_effect(name)
    ledger = open_ledger(config, make_folder(config.out))
    drift = find(config, ledger)
    print(f"\n{headline(drift)}")
    for cause in drift.causes:
        print(f"  {cause.name:26s} {', '.join(cause.numbers)}   ({cause.words})")
    if drift.verdict == AGREES and not config.anyway:
        finish(config, drift, [], ledger, None)
        return
    correct(config, drift, ledger)
    train(config, ledger)
    figures, picture = compare(config, ledger)
    finish(config, drift, figures, ledger, picture)


def open_ledger(config: RefreshConfig, out: Path) -> Ledger:
    """Return how far an earlier call came; other inputs are refused."""
    from tendon_newton.data.files.trust import content_hash
    from train.policy.worlds.force_model import file_hash
    from train.refresh.ledger import Ledger
    from train.refresh.logs import log_files
    from train.refresh.retraining import find_training

    def hashes(paths: tuple[Path, ...]) -> dict[str, str]:
        return {str(path): content_hash(path.read_bytes()) for path in log_files(paths)}

    inputs = {
        "logs": hashes(config.logs),
        "reference": hashes(config.reference),
        "model": file_hash(config.model),
        "policy": file_hash(find_training(config.policy).checkpoint),
        "suspects": config.suspects,
        "port": config.port,
    }
    return Ledger(out / "refresh.json", inputs)


def find(config: RefreshConfig, ledger: Ledger) -> Drift:
    """Hold the logs against the model."""
    from hardware.deployment.deploy_log import policy_span
    from tendon_newton.cli.output import make_folder
    from tendon_newton.data.model_file import load_model, write_model
    from tendon_newton.diagnosis.reporting.report import Origin, write_report
    from tendon_newton.diagnosis.result import write_diagnosis
    from train.refresh.drift import SUSPECTS, find_drift, growth, model_error
    from train.refresh.logs import fitted_parts, logs_as_dataset, read_logs
    from train.refresh.outcome import judge_drift, read_drift
    from train.refresh.slip import SLIP, taut_from
    from train.refresh.turning import slip_since

    if (done := ledger.done("drift")) is not None:
        return read_drift(done)
    model, logs = load_model(config.model), read_logs(config.logs, policy_span)
    later = fitted_parts(logs)
    suspects = config.suspects or tuple(SUSPECTS)
    folder = make_folder(config.out / "diagnosis")
    print("reading benches and compiling kernels ...", flush=True)
    dataset = logs_as_dataset(config.logs[0], logs, taut_from(later, model))
    earlier, grown, slip = None, None, None
    if config.reference:
        new = read_logs(config.reference, policy_span)
        reference = logs_as_dataset(config.out, new)
        earlier = model_error(reference.test, model)
        grown = growth(dataset, reference, model)
        slip = slip_since(fitted_parts(new), later) if SLIP in suspects else None
    diagnosis, evidence = find_drift(
        dataset,
        model,
        suspects=suspects,
        progress=lambda text: print(f"{text} ...", flush=True),
    )
    write_diagnosis(folder / "diagnosis.json", diagnosis)
    write_model(folder / "model.toml", diagnosis.model)
    write_report(folder / "report.html", diagnosis, evidence, Origin())
    drift = judge_drift(diagnosis, earlier, grown=grown, slip=slip)
    ledger.finish("drift", asdict(drift))
    return drift


def correct(config: RefreshConfig, drift: Drift, ledger: Ledger) -> None:
    """Put what was found into the model; where nothing was, fit all its numbers to the logs."""
    from hardware.deployment.deploy_log import policy_span
    from tendon_newton.data.model_file import load_model, write_model
    from train.refresh.logs import fitted_parts, read_logs, taut_parts
    from train.refresh.slip import SLIPS, taut_from, with_slip
    from train.refresh.tuning import tune

    if ledger.done("model") is not None:
        return
    print("correcting the model ...", flush=True)
    logs = fitted_parts(read_logs(config.logs, policy_span))
    model = load_model(config.model)
    if any(cause.name in SLIPS for cause in drift.causes):
        new = read_logs(config.reference, policy_span) if config.reference else ()
        corrected, how = with_slip(logs, model, fitted_parts(new)), "slip"
    elif drift.causes:  # all else was right when the bench was new
        corrected, how = load_model(config.out / "diagnosis" / "model.toml"), "cause"
    else:
        corrected, how = tune(taut_parts(logs, taut_from(logs, model)), model).model, "all"
    write_model(config.out / "model.toml", corrected)
    ledger.finish("model", {"fitted": how})


def train(config: RefreshConfig, ledger: Ledger) -> None:
    """Train the policy on."""
    import time

    from tendon_newton.cli.output import make_folder
    from tendon_newton.cli.train_policy import show
    from train.refresh.retraining import find_training, retrain

    done = ledger.done("training")
    if done is not None and done["iterations"] == config.iterations:
        return
    begin = time.monotonic()
    exported = retrain(
        find_training(config.policy),
        config.out / "model.toml",
        make_folder(config.out / "training"),
        iterations=config.iterations,
        device=config.device,
        report=show,
    )
    spent = time.monotonic() - begin + (done or {"seconds": 0.0})["seconds"]
    ledger.finish(
        "training",
        {
            "iterations": config.iterations,
            "seconds": spent,
            "samples": exported.card.training.samples,
        },
    )


def compare(config: RefreshConfig, ledger: Ledger) -> tuple[list[TipFigure], Path]:
    """Measure the old and the new policy, before and after, simulated and on the bench."""
    from tendon_newton.mechanisms.loading import load_mechanism
    from train.policy.scoring.evaluation import reachable_error
    from train.policy.scoring.evaluation_figure import draw_climbs
    from train.policy.scoring.evaluation_scores import score
    from train.refresh.outcome import TipFigure
    from train.refresh.retraining import find_training

    mechanism = load_mechanism(find_training(config.policy).config.environment.finger)
    climbs = [*simulated(config), *logged(config), *deployed_anew(config, ledger)]
    scores: list[ClimbScore] = [score(c, reachable_error(mechanism, c.goal)) for c in climbs]
    stairs = [k for k, c in enumerate(climbs) if c.time[-1] < 1.1 * climbs[0].time[-1]]
    picture = draw_climbs(
        [climbs[k] for k in stairs], [scores[k] for k in stairs], config.out / "climb.png"
    )
    figures = [TipFigure(policy=s.policy, where=s.place, rmse=s.rmse) for s in scores]
    ledger.finish("figures", [asdict(figure) for figure in figures])
    return figures, picture


def simulated(config: RefreshConfig) -> list[Climb]:
    """Let both policies climb the stairs on the old and on the corrected model."""
    from dataclasses import replace

    import numpy as np

    from hardware.control.goals import stairs
    from hardware.control.policy_runner import load_policy
    from train.policy.scoring.evaluation import RunnablePolicy, climb_stairs
    from train.refresh.retraining import find_training

    earlier = find_training(config.policy).config.environment
    goals = stairs()
    count = round((goals.end + 1.5) * earlier.rate)
    levels = np.array([goals.value((k + 0.5) / earlier.rate) for k in range(count)])
    old, new = config.policy, config.out / "training" / "policy.onnx"
    climbs: list[Climb] = []
    for name, file, force, place in (
        ("old", old, config.model, "simulation, as the model had it"),
        ("old", old, config.out / "model.toml", "simulation, corrected"),
        ("new", new, config.out / "model.toml", "simulation, corrected"),
    ):
        loaded = load_policy(file)
        policy = RunnablePolicy(name=name, card=loaded.card, run=loaded.run)
        worlds = replace(earlier, force=str(force), worlds=1, randomise=("none",))
        climbs += [replace(c, place=place) for c in climb_stairs([policy], levels, worlds)]
    return climbs


def logged(config: RefreshConfig) -> list[Climb]:
    """Read what the old policy did on the bench, before and now."""
    from train.refresh.logs import log_files

    return [
        *(climb_of(config, "old", log, "before") for log in log_files(config.reference)),
        *(climb_of(config, "old", log, "now") for log in log_files(config.logs)),
    ]


def deployed_anew(config: RefreshConfig, ledger: Ledger) -> list[Climb]:
    """Let the new policy climb on the bench, once for each length of its training."""
    from tendon_newton.cli.evaluate_policy import EvaluatePolicyConfig, deployed

    if config.port is None:
        return []
    done = ledger.done("bench")
    if done is None or done["iterations"] != config.iterations:
        new = config.out / "training" / "policy.onnx"
        words: dict[str, Any] = {
            key: getattr(config, key)
            for key in ("port", "load_cell_port", "calibration", "faster_than_real_time")
        }
        bench = EvaluatePolicyConfig(policies=(new,), out=config.out, **words)
        log = deployed(bench, new, config.out / "deployments")
        ledger.finish("bench", {"iterations": config.iterations, "log": str(log)})
    return [climb_of(config, "new", Path(ledger.done("bench")["log"]), "now")]


def climb_of(config: RefreshConfig, policy: str, log: Path, when: str) -> Climb:
    """Read a climb from a log."""
    from dataclasses import replace

    from hardware.control.policy_runner import load_policy
    from hardware.deployment.deploy_log import step_table
    from tendon_newton.mechanisms.loading import load_mechanism
    from train.policy.scoring.bench_climb import climb_on_bench
    from train.refresh.retraining import find_training

    mechanism = load_mechanism(find_training(config.policy).config.environment.finger)
    radius = load_policy(config.policy).card.spool_radius
    climb = climb_on_bench(policy, log, step_table(log), mechanism, radius)
    return replace(climb, place=f"{climb.place}, {when}: {log.name}")


def finish(
    config: RefreshConfig,
    drift: Drift,
    figures: list[TipFigure],
    ledger: Ledger,
    picture: Path | None,
) -> None:
    """Write the page and say where everything is."""
    from tendon_newton import __version__
    from train.refresh.outcome import write_page

    facts = {
        "logs": ", ".join(map(str, config.logs)),
        "model": str(config.model),
        "policy": str(config.policy),
        "program": f"tendon-newton {__version__}",
    }
    trained = ledger.done("training")
    if trained is not None:
        facts["training"] = (
            f"{trained['iterations']} iterations, {trained['samples']:,} steps, "
            f"{trained['seconds']:.0f} s on {config.device}"
        )
    write_page(config.out / "refresh.html", drift, figures, facts, picture)
    for figure in figures:
        print(f"  {figure.policy:4s} {1e3 * figure.rmse:6.1f} mm RMS   {figure.where}")
    print(f"\nwrote {config.out / 'refresh.html'}")
    if trained is not None:
        print(f"  corrected model  {config.out / 'model.toml'}")
        print(f"  new policy       {config.out / 'training' / 'policy.onnx'}")
