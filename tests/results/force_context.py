"""How much past and how much data a force network needs.

``python -m tests.results.force_context DATASET --out DIR`` trains one family with histories from
0.25 to 3 s, and with a part of the train recordings, prints the error on the test recordings and
draws it in ``force_context.png``. What is finished is not done again.
"""

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tendon_newton.dataset import Dataset, load_dataset
from tendon_newton.recording import Recording
from train.actuator.export import make_card
from train.actuator.force_data import ForceData, prepare
from train.actuator.force_network import ForceNetwork
from train.actuator.prediction import Prediction, predict
from train.actuator.protocol import Experiment, experiment_of
from train.actuator.scores import score
from train.actuator.training import train_network
from train.actuator.training_config import TrainingConfig

HISTORIES = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0)  # [s]
SHARES = (0.25, 0.5, 1.0)  # of the train recordings
RATE = 20.0  # [Hz]
PAPER_WINDOW = 30
COLOUR = "#1764ab"


def main() -> None:
    """Train, measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--network", default="transformer", choices=["mlp", "rnn", "transformer"])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--epochs", type=int, default=100)
    parser.add_argument("--windows-per-epoch", type=int, default=32768)
    parser.add_argument("--device", default="cpu")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    dataset = load_dataset(chosen.dataset)
    found: dict[tuple[int, float], list[float]] = {}
    print(f"{'history':>8} {'data':>6} {'seed':>5} {'steps, mean RMSE':>17} {'all rows':>9}  [N]")
    for seed in chosen.seeds:
        base = TrainingConfig(
            network=chosen.network,
            seed=seed,
            epochs=chosen.epochs,
            windows_per_epoch=chosen.windows_per_epoch,
            device=chosen.device,
        )
        for window, share in cases():
            result = measured(dataset, replace(base, window=window), share, chosen.out)
            found.setdefault((window, share), []).append(result["steps_rmse"])
            print(
                f"{window / RATE:6.2f} s {100 * share:4.0f} % {seed:5d} "
                f"{result['steps_rmse']:17.3f} {result['pooled_rmse']:9.3f}",
                flush=True,
            )
    draw(found, chosen.out / "force_context.png")


def draw(found: Mapping[tuple[int, float], Sequence[float]], path: Path) -> None:
    """Draw the errors of every seed over history and over data, and a line through their means."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    by_history, by_share = figure.subplots(1, 2, sharey=True)
    sides = (
        (by_history, {w / RATE: e for (w, share), e in found.items() if share == 1.0}),
        (by_share, {100.0 * share: e for (w, share), e in found.items() if w == PAPER_WINDOW}),
    )
    for axes, errors_at in sides:
        places = sorted(errors_at)
        axes.plot(places, [np.mean(errors_at[place]) for place in places], "o-", color=COLOUR)
        for place in places:
            axes.plot([place] * len(errors_at[place]), errors_at[place], "_", color=COLOUR)
        axes.grid(alpha=0.3)
    by_history.set_ylim(0.0, 1.1 * max(map(max, found.values())))
    by_history.set_xlabel("history [s], all recordings")
    by_history.set_ylabel("test steps, mean RMSE [N]")
    by_share.set_xlabel("train recordings [%], history 1.5 s")
    figure.savefig(path, dpi=150)


def cases() -> Iterator[tuple[int, float]]:
    """Yield windows [samples] with all data, then the paper's window with less."""
    for history in HISTORIES:
        yield round(history * RATE), 1.0
    for share in SHARES[:-1]:
        yield PAPER_WINDOW, share


def measured(dataset: Dataset, config: TrainingConfig, share: float, out: Path) -> dict[str, float]:
    """Train on a part of the recordings and return the errors on the test recordings [N]."""
    stem = f"{config.name}-{config.window}-{100 * share:.0f}"
    path = out / f"{stem}.json"
    if path.is_file():
        return json.loads(path.read_text())
    part = replace(dataset, train=first_part(dataset, share))
    data = prepare(part, config)
    network, _ = train_network(config, data.fit, data.validation, out / f"{stem}.checkpoint")
    result = errors(network, config, part, data)
    path.write_text(json.dumps(result) + "\n")
    return result


def first_part(dataset: Dataset, share: float) -> tuple[Recording, ...]:
    """Return so many of each bench's train recordings, drawn with a fixed seed, at least two."""
    rng = np.random.default_rng(0)
    kept: list[Recording] = []
    for bench in sorted({r.bench for r in dataset.train}):
        own = [r for r in dataset.train if r.bench == bench]
        count = max(2, round(share * len(own)))
        kept += [own[i] for i in rng.permutation(len(own))[:count]]
    return tuple(kept)


def errors(
    network: ForceNetwork, config: TrainingConfig, dataset: Dataset, data: ForceData
) -> dict[str, float]:
    """Return the mean error over the step experiments and the error over all rows [N]."""
    predictions = predict(network, make_card(network, config, dataset, data), data.test)
    steps: dict[Experiment, list[Prediction]] = {}
    for prediction in predictions:
        experiment = experiment_of(prediction.recording)
        if experiment.hold is not None:
            steps.setdefault(experiment, []).append(prediction)
    return {
        "steps_rmse": float(np.mean([score(group).rmse for group in steps.values()])),
        "pooled_rmse": score(predictions).rmse,
    }


if __name__ == "__main__":
    main()
