"""Does anything but a report depend on a test recording? Every verb, with test recordings as noise.

Each verb that reads a dataset runs twice: on recordings, and on the same with every signal of its
test recordings replaced by noise. What it fits, names or writes for the next program must be the
same to the last bit. What it reports must not be, or the noise was never read.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.cli import main as run
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.recording import Array, Recording
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.identification.cutting import rows_of
from tests.train.actuator.servo_logs import write_servo_dataset

EXAMPLE = Path(__file__).parents[1] / "examples" / "hidden_friction"
SIGNALS = ("command", "motor_position", "motor_velocity", "force", "tip")
NO_DATASET = {
    "demo": "is diagnose, on the recordings that come along",
    "import": "reads logs; where a model comes from them too, the lab has a case",
    "experiment": "reads a diagnosis",
    "oscillation": "looks at all rows of a log and learns nothing for another",
    "wear": "looks at all rows of logs and learns nothing for another",
    "servo": "copies a model",
    "explain": "reads a diagnosis",
    "asset": "reads an asset",
    "export": "reads a model",
    "train-policy": "reads a model",
    "evaluate-policy": "reads policies",
    "doctor": "reads a bench; with --against is diagnose --against",
    "calibrate": "reads a load cell",
    "collect": "writes a dataset",
    "deploy": "writes a log",
    "plot": "draws one log",
    "virtual-bench": "is a bench",
}
"""Verbs that read no dataset, and what they do."""


@dataclass(frozen=True, kw_only=True)
class Made:
    """What a verb made."""

    decided: Mapping[str, Any]  # What must not depend on test recordings, by name
    reported: Any  # What tells how a test recording came out


def noise_like(recording: Recording, rows: slice = slice(None)) -> Recording:
    """Return a recording of which some rows are noise of half each signal's mean, and its spread.

    Half, so that what a correction takes away from the truth makes noise worse.
    """
    rng = np.random.default_rng(1)

    def noise(values: Array) -> Array:
        made = np.array(values)
        spread = values.std(axis=0) + 1.0e-3
        made[rows] = 0.5 * values.mean(axis=0) + spread * rng.standard_normal(made[rows].shape)
        return made

    own = {name: getattr(recording, name) for name in SIGNALS}
    signals = {name: noise(values) for name, values in own.items() if values is not None}
    if "force" in signals:
        signals["force"] = np.abs(signals["force"])
    return replace(recording, **signals)


def write_either(
    folder: Path, train: Sequence[Recording], test: Sequence[Recording], noisy: bool
) -> Path:
    """Write a dataset, its test recordings as they are or as noise."""
    write_dataset(folder, train, [noise_like(r) for r in test] if noisy else test)
    return folder


def small_dataset(folder: Path, noisy: bool = False) -> Path:
    """Write five seconds each of three recordings of the bundled example, and its model."""
    whole = load_dataset(EXAMPLE)
    kept = {
        r.name: rows_of(r, slice(0, int(np.searchsorted(r.time, r.time[0] + 5.0))), r.name)
        for r in (*whole.train, *whole.test)
    }
    train = [kept["spring_weak_ramp_0.csv"], kept["spring_weak_steps_1.csv"]]
    write_either(folder, train, [kept["spring_weak_sine_2.csv"]], noisy)
    (folder / "model.toml").write_bytes((EXAMPLE / "model.toml").read_bytes())
    return folder


THEIRS = ("notes.txt", "results/thesis/data.csv", "models/mine/model.toml", "answer/truth.json")
"""Files of a user's own in a folder for results."""


def said(words: Sequence[str | Path]) -> str:
    """Run a verb and return what it prints; whatever else lies in its folder stays as it is."""
    theirs = [Path(words[words.index("--out") + 1]) / name for name in THEIRS]
    for file in theirs:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"the user's {file.name}")
    out = StringIO()
    with redirect_stdout(out):
        code = run([str(word) for word in words])
    assert code == 0, out.getvalue()
    assert [file.read_text() for file in theirs] == [f"the user's {file.name}" for file in theirs]
    return out.getvalue()


def diagnosed(answer: Mapping[str, Any], model: Path) -> Made:
    """Return what an answer decides and what it reports."""
    errors = ("baseline", "extended", "explained_fraction", "explained_fraction_ci95")
    free = (*errors, "wall_time_s", "peak_memory_mib", "unexplained", "effects")
    decided = {key: value for key, value in answer.items() if key not in free}
    decided["effects"] = [
        {key: value for key, value in effect.items() if key not in ("without", "gain")}
        for effect in answer["effects"]
    ]
    decided["structure"] = {k: v for k, v in answer["unexplained"].items() if k != "fraction"}
    decided["model.toml"] = model.read_text()
    return Made(decided=decided, reported=[answer[key] for key in errors])


def diagnose(folder: Path, noisy: bool) -> Made:
    """Names, numbers, intervals, classes and the extended model."""
    data = small_dataset(folder / "data", noisy)
    said(["diagnose", data, "--model", data / "model.toml", "--out", folder / "out"])
    answer = json.loads((folder / "out" / "diagnosis.json").read_text())
    return diagnosed(answer, folder / "out" / "model.toml")


def changed_days(folder: Path, noisy: bool) -> Made:
    """Numbers that moved since a day, their intervals, and the model of the second one."""
    first = small_dataset(folder / "first", noisy)
    second = small_dataset(folder / "second", noisy)
    said(["diagnose", second, "--against", first, "--out", folder / "out"])
    (day,) = json.loads((folder / "out" / "changes.json").read_text())["days"].values()
    reported = [day.pop(key) for key in ("before", "after", "doubt", "events")]
    return Made(
        decided={**day, "model.toml": (folder / "out" / "model.toml").read_text()},
        reported=reported,
    )


def simulate(folder: Path, noisy: bool) -> Made:
    """What the model makes of the train recordings."""
    data = small_dataset(folder / "data", noisy)
    words = ["--model", data / "model.toml", "--out", folder / "out", "--no-plots"]
    text = said(["simulate", data, *words])
    train = {r.name for r in load_dataset(data).train}
    made = {f.name: f.read_text() for f in (folder / "out").glob("*.csv") if f.name in train}
    assert len(made) == len(train)
    return Made(decided=made, reported=text)


def servo_dataset(folder: Path, noisy: bool) -> Path:
    """Write recordings of a made-up servo."""
    whole = load_dataset(write_servo_dataset(folder / "made"))
    return write_either(folder / "data", whole.train, whole.test, noisy)


def train_force(folder: Path, noisy: bool) -> Made:
    """Every weight, when the training stopped, and all of the card but its held-out error."""
    data = servo_dataset(folder, noisy)
    short = "--epochs 2 --windows-per-epoch 512 --batch 256 --network mlp"
    text = said(["train-force", data, *short.split(), "--out", folder / "nets"])
    weights = weights_of(folder / "nets" / "mlp-paper-0.checkpoint")
    history = json.loads((folder / "nets" / "mlp-paper-0.json").read_text())
    card = [line for line in text.splitlines() if line.startswith("in a simulation")]
    return Made(decided={"weights": weights, "history": history, "hold": card}, reported=text)


def weights_of(checkpoint: Path) -> dict[str, bytes]:
    """Return the bytes of every weight that a training kept."""
    import torch

    kept = torch.load(checkpoint, weights_only=True)["done"]["kept_weights"]
    return {name: values.numpy().tobytes() for name, values in kept.items()}


CASES: dict[str, Callable[[Path, bool], Made]] = {
    "simulate": simulate,
    "diagnose": diagnose,
    "diagnose against": changed_days,
    "train-force": train_force,
}
"""Verbs that read a dataset."""


def differences(make: Callable[[Path, bool], Made], folder: Path) -> list[str]:
    """Run a verb on recordings and on noise; return what differs and must not, and the reverse."""
    made = []
    for name, noisy in (("kept", False), ("noise", True)):
        (folder / name).mkdir()
        made.append(make(folder / name, noisy))
    kept, noise = (made_by.decided for made_by in made)
    wrong = sorted(n for n in {*kept, *noise} if kept.get(n) != noise.get(n))
    blind = made[0].reported == made[1].reported
    return [*wrong, "the report says the same"] if blind else wrong


def main(cases: Mapping[str, Callable[[Path, bool], Made]], program: str) -> int:
    """Run the verbs that are asked for, and print a line for each."""
    parser = argparse.ArgumentParser(prog=program, description=__doc__)
    parser.add_argument("verbs", nargs="*", metavar="VERB", help=f"of {', '.join(cases)}")
    chosen = parser.parse_args().verbs
    quiet_warp()
    failed = 0
    for case in chosen or cases:
        with tempfile.TemporaryDirectory() as folder:
            wrong = differences(cases[case], Path(folder))
        failed += bool(wrong)
        print(f"{case:16s} {'DIFFERS: ' + ', '.join(wrong) if wrong else 'same to the bit'}")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(CASES, "python -m tests.held_out"))
