"""How much past and which data a force network needs.

``python -m lab.studies.force_context DATASET --out DIR`` trains one family with histories from
0.25 to 3 s, and on parts of the train recordings, prints the error on the test recordings and
draws it in ``force_context.png``. ``--more DATASET`` names another collection of the same bench,
whose train recordings are added to the first one's. What is finished is not done again, so that
several processes can share the work (``--histories 3 --data --seeds 1``); with ``--read`` nothing
is trained, and what is there is shown.
"""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from tendon_lab.force_scoring.sample_protocol import experiment_of
from tendon_lab.force_scoring.scores import score
from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.files.picture import new_figure, save
from tendon_newton.data.recording import Recording
from tendon_newton.force_networks.force_network import ForceNetwork
from tendon_train.actuator.fitting.force_export import make_card
from tendon_train.actuator.fitting.training import train_network
from tendon_train.actuator.prediction import ForcePrediction, predict
from tendon_train.actuator.samples.folds import Fold, ForceData, prepare
from tendon_train.actuator.training_config import TrainingConfig

HISTORIES = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0)  # [s]
RATE = 20.0  # [Hz]
PAPER_WINDOW = 30
SHOWN = {"steps_rmse": ("test steps", "#1764ab"), "ramps_rmse": ("contact ramps", "#d1495b")}
OBSTACLES = ("tape_roll", "hand")

Part = Callable[[Sequence[Recording]], list[Recording]]


@dataclass(frozen=True, kw_only=True)
class Case:
    """What one network sees."""

    window: int = PAPER_WINDOW
    data: str = "all"

    @property
    def label(self) -> str:
        """Return words for a row."""
        return f"{self.window / RATE:5.2f} s  {self.data:18s}"


def shared(share: float) -> Part:
    """Return so many of each bench's recordings, drawn with a fixed seed, at least two."""

    def part(recordings: Sequence[Recording]) -> list[Recording]:
        rng = np.random.default_rng(0)
        kept: list[Recording] = []
        for bench in sorted({r.bench for r in recordings}):
            own = [r for r in recordings if r.bench == bench]
            count = max(2, round(share * len(own)))
            kept += [own[i] for i in rng.permutation(len(own))[:count]]
        return kept

    return part


PARTS: dict[str, Part] = {
    "25 %": shared(0.25),
    "50 %": shared(0.5),
    "all": list,
    "nothing in the way": lambda rs: [r for r in rs if not any(o in r.name for o in OBSTACLES)],
    "no random steps": lambda rs: [r for r in rs if "random_steps" not in r.name],
    "random steps alone": lambda rs: [r for r in rs if "random_steps" in r.name],
}
"""Which of the train recordings a network sees."""
DOUBLE = "200 %"


def main() -> None:
    """Train, measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--more", type=Path, help="another collection, to double the data")
    parser.add_argument("--network", default="transformer", choices=["mlp", "rnn", "transformer"])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--histories", type=float, nargs="*", default=HISTORIES, help="[s]")
    parser.add_argument("--data", nargs="*", default=(*PARTS, DOUBLE), choices=(*PARTS, DOUBLE))
    parser.add_argument("--epochs", type=int, default=30)
    parser.add_argument("--windows-per-epoch", type=int, default=32768)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--read", action="store_true", help="train nothing, show what is there")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)
    dataset = load_dataset(chosen.dataset)
    more = load_dataset(chosen.more).train if chosen.more else None
    found: dict[Case, list[dict[str, float]]] = {}
    for case in cases(chosen.histories, [d for d in chosen.data if d != DOUBLE or more]):
        for seed in chosen.seeds:
            config = TrainingConfig(
                network=chosen.network,
                seed=seed,
                epochs=chosen.epochs,
                patience=chosen.epochs,
                windows_per_epoch=chosen.windows_per_epoch,
                window=case.window,
                device=chosen.device,
            )
            if chosen.read and not result_file(config, case, chosen.out).is_file():
                continue
            part = replace(dataset, train=part_of(dataset.train, case.data, more))
            found.setdefault(case, []).append(measured(part, config, case, chosen.out))
        if case in found:
            print(row(case, found[case]), flush=True)
    if {case.window for case in found} > {PAPER_WINDOW} and len(found) > len(chosen.histories):
        draw(found, chosen.out / "force_context.png")


def cases(histories: Sequence[float], data: Sequence[str]) -> list[Case]:
    """Return histories with all data, then the paper's window with other data, each once."""
    by_history = [Case(window=round(history * RATE)) for history in histories]
    return list(dict.fromkeys([*by_history, *(Case(data=name) for name in data)]))


def part_of(
    recordings: Sequence[Recording], data: str, more: Sequence[Recording] | None
) -> tuple[Recording, ...]:
    """Return the train recordings of a case."""
    if data != DOUBLE:
        return tuple(PARTS[data](recordings))
    assert more is not None
    return (*recordings, *(replace(r, name=f"more/{r.name}") for r in more))


def measured(dataset: Dataset, config: TrainingConfig, case: Case, out: Path) -> dict[str, float]:
    """Train on a part of the recordings and return the errors on the test recordings [N]."""
    path = result_file(config, case, out)
    if path.is_file():
        return json.loads(path.read_text())
    data = prepare(dataset, config)
    network, _ = train_network(config, data.fit, data.validation, path.with_suffix(".checkpoint"))
    result = errors(network, config, dataset, data)
    path.write_text(json.dumps(result) + "\n")
    return result


def result_file(config: TrainingConfig, case: Case, out: Path) -> Path:
    """Return where a network's errors stand."""
    data = case.data.replace(" ", "_").replace("%", "percent")
    return out / f"{config.name}-{case.window}-{data}.json"


def errors(
    network: ForceNetwork, config: TrainingConfig, dataset: Dataset, data: ForceData
) -> dict[str, float]:
    """Return the mean errors over step and ramp experiments, and the error over all rows [N]."""
    unnamed = replace(data, fold=Fold(fit=(), validation=()))  # added recordings have no file here
    card = make_card(network, config, dataset, unnamed)
    predictions = predict(network, card, data.test)
    groups: dict[str, dict[object, list[ForcePrediction]]] = {"steps": {}, "ramps": {}}
    for prediction in predictions:
        experiment = experiment_of(prediction.recording)
        if experiment.hold is not None:
            groups["steps"].setdefault(experiment, []).append(prediction)
        elif experiment.is_contact_ramp:
            groups["ramps"].setdefault(experiment, []).append(prediction)
    means = {
        f"{name}_rmse": float(np.mean([score(own).rmse for own in group.values()]))
        for name, group in groups.items()
        if group
    }
    return means | {"pooled_rmse": score(predictions).rmse}


def row(case: Case, found: Sequence[Mapping[str, float]]) -> str:
    """Return a case's errors, mean and spread over seeds [N]."""
    cells = []
    for name in found[0]:
        values = [one[name] for one in found]
        spread = f" ± {np.std(values, ddof=1):.3f}" if len(values) > 1 else ""
        cells.append(f"{name.removesuffix('_rmse')} {np.mean(values):.3f}{spread}")
    return f"{case.label}  {len(found)} seeds   {'   '.join(cells)}   [N]"


def draw(found: Mapping[Case, Sequence[Mapping[str, float]]], path: Path) -> None:
    """Draw the errors of every seed over history and by data, and their means."""
    figure = new_figure(10.0, 3.6)
    by_history, by_data = figure.subplots(1, 2)
    for place, (key, (label, colour)) in enumerate(SHOWN.items()):
        errors_of = {case: [one[key] for one in seeds] for case, seeds in found.items()}
        histories = {c.window / RATE: e for c, e in errors_of.items() if c.data == "all"}
        at = sorted(histories)
        by_history.plot(at, [np.mean(histories[x]) for x in at], color=colour, label=label)
        for x in at:
            by_history.plot([x] * len(histories[x]), histories[x], "_", color=colour)
        named = {c.data: e for c, e in errors_of.items() if c.window == PAPER_WINDOW}
        names = [name for name in (DOUBLE, *reversed(PARTS)) if name in named]
        rows = np.arange(len(names)) - 0.4 * place
        means = [np.mean(named[name]) for name in names]
        by_data.barh(rows, means, height=0.4, color=colour, alpha=0.35, label=label)
        for y, name in zip(rows, names, strict=True):
            by_data.plot(named[name], [y] * len(named[name]), "|", color=colour)
        by_data.set_yticks(np.arange(len(names)) - 0.2, names)
    for axes in (by_history, by_data):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize=8)
    by_history.set_ylim(bottom=0.0)
    by_history.set_xlabel("history [s], all recordings")
    by_history.set_ylabel("mean RMSE [N]")
    by_data.set_xlabel("mean RMSE [N], history 1.5 s")
    save(figure, path, dpi=150)


if __name__ == "__main__":
    main()
