"""Training finds what the past says, the same in every run, and survives an interruption."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn

from tendon_newton.cli import main
from tendon_newton.data.dataset import ListedRecording, list_recording
from tendon_newton.errors import InvalidNetworkFile, InvalidOutput, InvalidParameter
from tendon_newton.force_networks.weights_file import card_of_weights
from tendon_train.actuator.fitting import descent
from tendon_train.actuator.fitting.checkpoint import RECIPE, TOLERANCE
from tendon_train.actuator.fitting.descent import WARM_UP, Descent, cycle
from tendon_train.actuator.fitting.training import FittingProgress, train_network
from tendon_train.actuator.prediction import predict
from tendon_train.actuator.samples import changed_windows, sample_departure, servo_law
from tendon_train.actuator.samples.changed_windows import ANGLE, COMMAND, SPEED, ZERO, disturbed
from tendon_train.actuator.samples.windows import Windows, WindowShape, extract_windows
from tendon_train.actuator.training_config import TrainingConfig
from tests.bad_input.damage import refusal
from tests.faults.outside import full_disk
from tests.train.actuator.network_files import card_of
from tests.train.actuator.servo_logs import servo_log

FEW = TrainingConfig(network="mlp", epochs=3, windows_per_epoch=2048, batch=256)
RECIPE_NUMBERS = {
    "changed_windows.ZERO": 0.02, "changed_windows.COMMAND": 0.03, "changed_windows.ANGLE": 0.003,
    "changed_windows.SPEED": 0.03, "changed_windows.TAUT": 0.3, "changed_windows.REST_SPEED": 0.05,
    "changed_windows.SHARE": 0.5, "changed_windows.FEWEST": 3, "changed_windows.LATEST": 0.8,
    "changed_windows.SHORTEST": 0.05, "changed_windows.LONGEST": 1.05,
    "sample_departure.SHARE": 0.5, "sample_departure.FIRST_SHARE": 0.25,
    "sample_departure.FIRST_PART": 0.8, "sample_departure.ZERO": 0.3, "sample_departure.ANGLE": 0.1,
    "sample_departure.SPEED": 0.5, "sample_departure.SHORTEST": 0.05,
    "sample_departure.LONGEST": 1.0, "descent.LEAST_SIDE": 16, "descent.MUON_RATE": 5.0,
    "descent.WARM_UP": 0.05, "servo_law.HOLD_LIMIT": 1000.0, "servo_law.SLIDING": 0.15,
    "servo_law.TAUT": 0.3, "servo_law.FEWEST": 200,
}  # fmt: skip
"""What recipe 1 does with windows and weights."""


def windows_of(*seeds: int, window: int = 30, duration: float = 20.0) -> Windows:
    """Cut the recordings of some seeds into windows."""
    names = ("random_steps", "sine", "ramps")
    logs = [
        servo_log(f"{seed}.csv", excitation=names[seed % 3], seed=seed, duration=duration)
        for seed in seeds
    ]
    return extract_windows(logs, WindowShape(window=window))


def weights_of(config: TrainingConfig, checkpoint: Path) -> dict[str, torch.Tensor]:
    """Train on fixed recordings and return the weights."""
    network, _ = train_network(config, windows_of(0, 1), windows_of(2), checkpoint)
    return network.state_dict()


def same(one: dict[str, torch.Tensor], other: dict[str, torch.Tensor]) -> bool:
    """Say whether weights are equal bit for bit."""
    return all(torch.equal(one[name], other[name]) for name in one)


@pytest.mark.parametrize(
    ("kind", "window"),
    [
        ("transformer", 30),
        ("rnn", 60),
        *(pytest.param(kind, 30, marks=pytest.mark.slow) for kind in ("mlp", "rnn")),
    ],
)
def test_every_network_learns_a_force_with_memory(tmp_path: Path, kind: str, window: int) -> None:
    """On a recording it never saw, a short training beats the best ideal source by far.

    The plant holds up to 1 N by friction, which no function of theta_d - theta can know.
    """
    config = TrainingConfig(
        network=kind,
        window=window,
        epochs=6,
        windows_per_epoch=3072,
        batch=128,
        learning_rate=6.0e-3,
    )
    fit, validation = windows_of(0, 1, 3, 4, window=window), windows_of(2, 5, window=window)
    network, done = train_network(config, fit, validation, tmp_path / "c.checkpoint")
    card = card_of(kind, window=window)
    test = servo_log("test.csv", excitation="steps_held_2s", duration=16.0, seed=9)
    (prediction,) = predict(network, card, [test])
    stretch = np.maximum(test.command - test.motor_position, 0.0)[:, 0]
    gain = float(stretch @ test.force[:, 0] / (stretch @ stretch))
    ideal = test.force[:, 0] - gain * stretch  # of the best ideal source, fitted to the test
    error = float(np.sqrt(np.mean(prediction.error**2)))
    assert prediction.rows.size == test.sample_count
    assert error < 0.5 * float(np.sqrt(np.mean(ideal**2)))
    assert done.best_error == min(pair[1] for pair in done.history)


def test_the_same_seed_gives_the_same_network(tmp_path: Path) -> None:
    """Bit for bit; another seed gives another one."""
    short = replace(FEW, epochs=1, windows_per_epoch=512)
    first = weights_of(short, tmp_path / "a.checkpoint")
    assert same(first, weights_of(short, tmp_path / "b.checkpoint"))
    assert not same(first, weights_of(replace(short, seed=1), tmp_path / "c.checkpoint"))


@pytest.mark.parametrize("of_set", ["paper", "authors"])
def test_an_interrupted_training_goes_on_as_if_it_had_not_been(tmp_path: Path, of_set: str) -> None:
    """Interrupted after an epoch and taken up again, it ends with the same weights, bit for bit."""
    config = replace(FEW, network="transformer", set=of_set, windows_per_epoch=512)
    whole = weights_of(config, tmp_path / "whole.checkpoint")

    def interrupt(progress: FittingProgress) -> None:
        raise KeyboardInterrupt

    parts = tmp_path / "parts.checkpoint"
    with pytest.raises(KeyboardInterrupt):
        train_network(config, windows_of(0, 1), windows_of(2), parts, report=interrupt)
    assert same(whole, weights_of(config, parts))


def test_a_training_that_diverges_is_named(tmp_path: Path) -> None:
    """A learning rate at which numbers overflow leaves an error and no network."""
    config = replace(FEW, learning_rate=1.0e5)
    with pytest.raises(InvalidParameter, match="learning_rate below 100000 may help"):
        weights_of(config, tmp_path / "c.checkpoint")


def test_a_finished_training_is_not_done_again(tmp_path: Path) -> None:
    """The second call reports no epoch and returns the same weights."""
    first, epochs = weights_of(FEW, tmp_path / "a.checkpoint"), []
    network, _ = train_network(
        FEW, windows_of(0, 1), windows_of(2), tmp_path / "a.checkpoint", report=epochs.append
    )
    assert epochs == []
    assert same(first, network.state_dict())


def test_training_stops_when_validation_stops_improving(tmp_path: Path) -> None:
    """The kept epoch is ``patience`` epochs before the last, and none after it is as good."""
    config = replace(FEW, epochs=100, patience=2, learning_rate=0.05)
    _, done = train_network(
        config, windows_of(0, duration=6.0), windows_of(2, duration=6.0), tmp_path / "a.checkpoint"
    )
    assert done.epoch == done.kept_epoch + 2 < 100
    errors = [pair[1] for pair in done.history]
    assert errors[done.kept_epoch - 1] <= TOLERANCE * min(errors) < min(errors[done.kept_epoch :])


def test_a_checkpoint_of_another_training_is_refused(tmp_path: Path) -> None:
    """Other settings or other recordings: going on would mix two trainings."""
    weights_of(FEW, tmp_path / "a.checkpoint")
    with pytest.raises(InvalidNetworkFile, match=r"began with batch = 256, and now it is 128"):
        weights_of(replace(FEW, batch=128), tmp_path / "a.checkpoint")
    with pytest.raises(InvalidNetworkFile, match="began with data"):
        train_network(FEW, windows_of(0, 3), windows_of(2), tmp_path / "a.checkpoint")


def test_a_full_disk_ends_a_training_in_words(tmp_path: Path) -> None:
    """The error names the checkpoint, and no half of one is left."""
    with full_disk(1000), pytest.raises(InvalidOutput, match=r"checkpoint: cannot be written"):
        weights_of(FEW, tmp_path / "a.checkpoint")
    assert not list(tmp_path.iterdir())


def test_a_checkpoint_of_another_recipe_is_refused(tmp_path: Path) -> None:
    """Begun by another version's recipe, or by one from before recipes had numbers."""
    path = tmp_path / "a.checkpoint"
    weights_of(FEW, path)
    table = torch.load(path, weights_only=True)
    for saved, said in (
        ({"recipe": RECIPE - 1}, f"recipe = {RECIPE - 1}, and"),
        ({}, "recipe = None"),
    ):
        rest = {key: value for key, value in table["settings"].items() if key != "recipe"}
        torch.save(table | {"settings": rest | saved}, path)
        with pytest.raises(InvalidNetworkFile, match=said):
            weights_of(FEW, path)


def test_a_recipe_has_its_numbers() -> None:
    """Whoever changes one of them raises RECIPE, writes the new ones here, and so says it."""
    numbers = {
        f"{module.__name__.rpartition('.')[2]}.{name}": value
        for module in (changed_windows, sample_departure, descent, servo_law)
        for name, value in vars(module).items()
        if name.isupper() and type(value) in (int, float)
    }
    assert RECIPE == 1
    assert numbers == RECIPE_NUMBERS


def test_a_damaged_checkpoint_is_named(tmp_path: Path) -> None:
    """Cut short or of another program: an error of ours, and nothing in it is run."""
    path = tmp_path / "a.checkpoint"
    weights_of(FEW, path)
    content = path.read_bytes()
    for damaged in (content[: len(content) // 2], b"", b"not a checkpoint"):
        path.write_bytes(damaged)
        with pytest.raises(InvalidNetworkFile, match="delete it to start again"):
            weights_of(FEW, path)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"window": 0}, "window must be 1 or more"),
        ({"learning_rate": -1.0}, "learning_rate must be positive"),
    ],
)
def test_a_training_that_makes_no_sense_is_refused(changes: dict, said: str) -> None:
    """Before anything is read."""
    with pytest.raises(InvalidParameter, match=said):
        replace(FEW, **changes)


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU here")
def test_a_missing_gpu_is_named(tmp_path: Path) -> None:
    """Asked for CUDA where there is none, the message says what to use."""
    with pytest.raises(InvalidParameter, match="use cpu"):
        weights_of(replace(FEW, device="cuda"), tmp_path / "a.checkpoint")


WINDOWS = torch.zeros(4000, 30, 3)


def test_the_learning_rate_is_one_cycle() -> None:
    """Nothing at the start, all after the warm-up, nothing at the end, and no step back between."""
    rates = np.array([cycle(share) for share in np.linspace(0.0, 1.0, 1001)])
    top = int(np.argmax(rates))
    assert rates[0] == pytest.approx(0.0) == rates[-1]
    assert rates[top] == pytest.approx(1.0)
    assert top == pytest.approx(1000 * WARM_UP, abs=1)
    assert np.all(np.diff(rates[: top + 1]) > 0.0)
    assert np.all(np.diff(rates[top:]) < 0.0)


def test_wide_matrices_move_alike_in_all_directions() -> None:
    """Muon's step of a matrix has singular values within a factor of two of each other.

    Its five iterations bring them to 0.7 to 1.2, not to one; the gradient's differ tenfold here.
    """
    torch.manual_seed(0)
    layer = nn.Linear(24, 24)
    before = layer.weight.detach().clone()
    inputs = torch.randn(500, 24) * torch.logspace(0.0, -0.5, 24)
    loss = (layer(inputs) - inputs.flip(1)).square().mean()
    (gradient,) = torch.autograd.grad(loss, layer.weight, retain_graph=True)
    Descent(layer, 1.0e-3).step(loss, WARM_UP)
    assert spread(gradient) > 5.0
    assert spread(layer.weight.detach() - before) < 2.0


def spread(matrix: torch.Tensor) -> float:
    """Return the largest singular value over the smallest [1]."""
    sizes = torch.linalg.svdvals(matrix)
    return float(sizes[0] / sizes[-1])


def test_narrow_layers_are_left_to_adam() -> None:
    """The first step of Adam has the size of its learning rate, whatever the gradient."""
    torch.manual_seed(0)
    layer = nn.Linear(3, 16)
    before = [p.detach().clone() for p in layer.parameters()]
    Descent(layer, 1.0e-3).step(layer(torch.randn(50, 3)).square().mean(), WARM_UP)
    for parameter, old in zip(layer.parameters(), before, strict=True):
        moved = (parameter.detach() - old).abs()
        torch.testing.assert_close(moved, torch.full_like(moved, 1.0e-3), rtol=1e-3, atol=0.0)


def test_windows_are_disturbed_as_stated() -> None:
    """Both angles share a zero, the command has its own error for a window, samples have noise.

    4,000 windows: standard deviations to 5 %.
    """
    moved = disturbed(WINDOWS, torch.Generator().manual_seed(0))
    command, angle, speed = moved.unbind(dim=2)
    assert float(command.std(dim=1).max()) < 1e-6
    assert float(command[:, 0].std()) == pytest.approx(np.hypot(ZERO, COMMAND), rel=0.05)
    assert float(angle.mean(dim=1).std()) == pytest.approx(ZERO, rel=0.05)
    assert float((angle - angle.mean(dim=1, keepdim=True)).std()) == pytest.approx(ANGLE, rel=0.05)
    assert float(speed.std()) == pytest.approx(SPEED, rel=0.05)
    assert float((command[:, 0] - angle.mean(dim=1)).std()) == pytest.approx(COMMAND, rel=0.05)


def test_a_generator_decides_how_windows_are_disturbed() -> None:
    """The same seed disturbs alike, and what was handed in stays as it was."""
    one = disturbed(WINDOWS, torch.Generator().manual_seed(1))
    torch.testing.assert_close(one, disturbed(WINDOWS, torch.Generator().manual_seed(1)))
    assert not WINDOWS.any()


def test_a_network_knows_one_servo(tmp_path: Path, capsys) -> None:
    """Recordings of two servos in one folder train none; the card says whose a network is."""
    data = tmp_path / "data"
    for place, servo in enumerate(("xc330_t288_t", "xc330_t288_t", "sts3215")):
        out = tmp_path / str(place)
        words = ["--port", "virtual", "--servo", servo, "--seed", str(place), "--duration", "8"]
        words += ["--excitation", "ramps"]
        assert main(["collect", *words, "--faster-than-real-time", "--out", str(out)]) == 0
        data.mkdir(exist_ok=True)
        shutil.copy(out / "finger_ramps_0.mcap", data / f"{place}.mcap")
        entry = ListedRecording(file=f"{place}.mcap", bench="finger", split="train")
        list_recording(data, entry)
        if place == 1:
            short = ["--network", "mlp", "--set", "matched", "--epochs", "1"]
            train = ["train-force", str(data), *short, "--out", str(tmp_path / "nets")]
            assert main(train) == 0
            (file,) = (tmp_path / "nets").glob("*.safetensors")
            assert card_of_weights(file.read_bytes()).servo == "xc330_t288_t"
            assert main(["doctor", str(data)]) == 0
    capsys.readouterr()
    assert "one servo; the recordings are of sts3215, xc330_t288_t" in refusal(train, capsys)
    assert main(["doctor", str(data)]) == 1
    assert "a model is of one servo" in capsys.readouterr().out


def test_a_dataset_that_cannot_train_is_one_line(tmp_path, capsys) -> None:
    """No such folder."""
    line = refusal(["train-force", str(tmp_path / "none"), "--out", str(tmp_path / "nets")], capsys)
    assert line.startswith("error: ")
