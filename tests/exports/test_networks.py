"""Networks of a servo's force in the formats of other simulators' drives."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from newton.actuators import DriveNeuralGRU, DriveNeuralLSTM, DriveNeuralMLP

from tendon_newton.exports.networks.files import (
    ScaledLstm,
    write_gru_onnx,
    write_lstm_onnx,
    write_mlp_onnx,
    write_torchscript,
)
from tendon_newton.exports.networks.network_target import loading_text
from tendon_newton.exports.networks.students import (
    HELD_OUT,
    HISTORY,
    MEMORY,
    RATE,
    Lessons,
    fit_gru,
    fit_lstm,
    fit_mlp,
    lessons_of,
)
from tendon_newton.simulation.hosts.replay import bench_of
from tests.exports.models import model_of

SAME = 2.0e-6  # N: float32 through two runtimes
FEW = 5  # steps of training where only the files matter


@pytest.fixture(scope="module")
def lessons() -> Lessons:
    """What an ideal servo on the finger does."""
    model = model_of("finger", "ideal")
    return lessons_of(bench_of("finger", model), model)


def test_a_student_learns_the_force_of_a_servo(lessons: Lessons) -> None:
    """An ideal servo is P times the error, cut at zero: an MLP finds it on unseen runs.

    A fifth of an export's training leaves less than a fifth of the forces' spread.
    """
    _, error = fit_mlp(lessons, steps=300)
    assert error < 0.2 * float(lessons.force[-HELD_OUT:].std())


def test_newton_s_drive_reads_the_mlp(lessons: Lessons, tmp_path: Path) -> None:
    """It finds order, history and scales; the file gives the network's force."""
    network, _ = fit_mlp(lessons, steps=FEW)
    path = tmp_path / "mlp.onnx"
    write_mlp_onnx(path, network, lessons.scales)
    drive = DriveNeuralMLP(str(path))
    assert (drive.input_order, list(drive.input_idx)) == ("pos_vel", list(range(HISTORY)))
    scales = (drive.pos_scale, drive.vel_scale, drive.effort_scale)
    assert scales == pytest.approx(lessons.scales)
    import onnxruntime

    x = np.random.default_rng(0).normal(size=(4, 2 * HISTORY)).astype(np.float32)
    (theirs,) = onnxruntime.InferenceSession(str(path)).run(None, {"input": x})
    ours = network(torch.tensor(x)).detach().numpy()
    assert theirs == pytest.approx(ours, abs=SAME)


def test_newton_s_drive_reads_the_lstm(lessons: Lessons, tmp_path: Path) -> None:
    """It finds the names of input and state; ten samples give the network's forces."""
    network, _ = fit_lstm(lessons, steps=FEW)
    path = tmp_path / "lstm.onnx"
    write_lstm_onnx(path, network, lessons.scales)
    drive = DriveNeuralLSTM(str(path))
    assert drive.effort_scale == pytest.approx(lessons.scales[2])
    import onnxruntime

    session = onnxruntime.InferenceSession(str(path))
    hidden = cell = np.zeros((1, 3, MEMORY), dtype=np.float32)
    state = (torch.zeros(1, 3, MEMORY), torch.zeros(1, 3, MEMORY))
    for sample in np.random.default_rng(0).normal(size=(10, 3, 2)).astype(np.float32):
        given = {"input": sample[None], "hidden": hidden, "cell": cell}
        theirs, hidden, cell = session.run(None, given)
        ours, state = network(torch.tensor(sample[:, None]), state)
        assert theirs == pytest.approx(ours[:, 0].detach().numpy(), abs=SAME)


def test_newton_s_drive_reads_the_gru(lessons: Lessons, tmp_path: Path) -> None:
    """It takes order, rate and gates; ten samples of command, angle and speed give the forces."""
    network, _ = fit_gru(lessons, steps=FEW)
    path = tmp_path / "gru.onnx"
    write_gru_onnx(path, network, lessons.spread)
    DriveNeuralGRU(str(path))  # refuses a graph, a column or a normalisation that it cannot run
    import onnxruntime

    session = onnxruntime.InferenceSession(str(path))
    hidden, state = np.zeros((1, 3, MEMORY), dtype=np.float32), torch.zeros(1, 3, MEMORY)
    for sample in np.random.default_rng(0).normal(size=(10, 3, 3)).astype(np.float32):
        theirs, hidden = session.run(None, {"input": sample[None], "hidden": hidden})
        ours, state = network(torch.tensor(sample[:, None]), state)
        assert theirs == pytest.approx(ours[:, 0].detach().numpy(), abs=SAME)
    told = json.loads(session.get_modelmeta().custom_metadata_map["metadata"])
    assert told["sample_dt_s"] == pytest.approx(1.0 / RATE)
    means, _ = lessons.spread
    assert told["normalization"]["inputs"]["mean"]["target_position"] == pytest.approx(means[0])
    assert told["normalization"]["targets"]["mean"]["torque"] == pytest.approx(means[3])


def test_command_and_angle_apart_say_more_than_their_difference(lessons: Lessons) -> None:
    """A GRU learns the force of an ideal servo as well; the error is on runs it has not seen."""
    _, error = fit_gru(lessons, steps=150)
    assert error < 0.2 * float(lessons.force[-HELD_OUT:].std())


def test_isaac_lab_s_lstm_has_its_scales_inside(lessons: Lessons, tmp_path: Path) -> None:
    """Raw errors and speeds go in, forces come out; the memory's size is where it is looked for."""
    network, _ = fit_lstm(lessons, steps=FEW)
    path = tmp_path / "lstm.pt"
    write_torchscript(path, ScaledLstm(network, lessons.scales))
    with pytest.warns(DeprecationWarning, match="torch.jit.load"):  # what Isaac Lab calls
        loaded = torch.jit.load(path)
    assert loaded.lstm.state_dict()["weight_hh_l0"].shape[1] == MEMORY
    raw = torch.tensor([[[0.3, -1.2]]])
    blank = torch.zeros(1, 1, MEMORY)
    force, _ = loaded(raw, (blank, blank))
    pos, vel, effort = lessons.scales
    scaled, _ = network(raw * torch.tensor([pos, vel]), (blank, blank))
    assert float(force.detach()) == pytest.approx(effort * float(scaled.detach()), abs=SAME)


def test_the_page_says_that_no_transformer_goes_there() -> None:
    """It offers what there is, with its error; an equation's page says nothing of it."""
    told = loading_text((1.0, 1.0, 1.0), {"MLP": 0.2, "LSTM": 0.3}, learned=True)
    assert "no Transformer" in told
    assert "| LSTM | 0.3000 N |" in told
    assert "Transformer" not in loading_text((1.0, 1.0, 1.0), {}, learned=False)
