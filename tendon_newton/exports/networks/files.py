"""Students as files: ONNX for Newton's neural drives, TorchScript for Isaac Lab and mjlab."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import torch

from tendon_newton.data.files.text_file import write_bytes
from tendon_newton.data.recording import Array
from tendon_newton.exports.networks.students import HISTORY, MEMORY, RATE, StudentMemory, StudentMlp

OPSET = 17
IR_VERSION = 9  # Version of ONNX files that runtimes of the last years read
METADATA = "metadata"  # Key under which Newton's drives look for a JSON object
# ONNX's order of an LSTM's gates (input, output, forget, cell) and of a GRU's (update, reset, new)
# among torch's
GATES = {"LSTM": (0, 3, 1, 2), "GRU": (1, 0, 2)}
# What Newton's GRU is shown, by Newton's names
GRU_COLUMNS = ("target_position", "position", "velocity")

# What errors and speeds are multiplied by, and then the network's answer
Scales = tuple[float, float, float]


def scale_numbers(scales: Scales) -> dict[str, float]:
    """Return the scales by the names that Newton's drives read."""
    return dict(zip(("pos_scale", "vel_scale", "effort_scale"), scales, strict=True))


def write_mlp_onnx(path: Path, network: StudentMlp, scales: Scales) -> None:
    """Write an MLP for Newton's `DriveNeuralMLP`."""
    from onnx import helper

    nodes, weights, name = [], [], "input"
    linear = [layer for layer in network.layers if isinstance(layer, torch.nn.Linear)]
    for number, layer in enumerate(linear):
        weights += arrays({f"w{number}": layer.weight, f"b{number}": layer.bias})
        last = number == len(linear) - 1
        out = "output" if last else f"x{number}"
        nodes.append(helper.make_node("Gemm", [name, f"w{number}", f"b{number}"], [out], transB=1))
        if not last:
            nodes.append(helper.make_node("Tanh", [out], [f"y{number}"]))
        name = f"y{number}"
    ends = ([("input", ["worlds", 2 * HISTORY])], [("output", ["worlds", 1])])
    meta = {
        "model_type": "mlp",
        "input_order": "pos_vel",
        "input_idx": list(range(HISTORY)),
        **scale_numbers(scales),
    }
    save(path, nodes, weights, ends, meta)


def write_lstm_onnx(path: Path, network: StudentMemory, scales: Scales) -> None:
    """Write an LSTM for Newton's `DriveNeuralLSTM`: time first, one sample at a time."""
    meta = {
        "model_type": "lstm",
        "num_layers": 1,
        "hidden_size": MEMORY,
        "input_name": "input",
        "hidden_in_name": "hidden",
        "cell_in_name": "cell",
        "output_name": "output",
        "hidden_out_name": "new_hidden",
        "cell_out_name": "new_cell",
        **scale_numbers(scales),
    }
    write_memory(path, network, 2, meta)


def write_gru_onnx(path: Path, network: StudentMemory, spread: tuple[Array, Array]) -> None:
    """Write a GRU for Newton's `DriveNeuralGRU`: time first, one sample at a time.

    `spread` has mean and standard deviation of its columns and of the force, shape (4,).
    """
    seen, given = {}, {}
    for name, values in zip(("mean", "std"), spread, strict=True):
        *columns, force = (float(value) for value in values)
        seen[name] = dict(zip(GRU_COLUMNS, columns, strict=True))
        given[name] = {"torque": force}
    meta = {
        "model_type": "gru",
        "input_columns": list(GRU_COLUMNS),
        "normalization": {"inputs": seen, "targets": given},
        "sample_dt_s": 1.0 / RATE,
    }
    write_memory(path, network, len(GRU_COLUMNS), meta, linear_before_reset=1)


def write_memory(
    path: Path, network: StudentMemory, columns: int, meta: dict[str, Any], **options: Any
) -> None:
    """Write an LSTM or a GRU that sees so many columns; options are those of ONNX's node."""
    from onnx import helper

    cell, head = network.memory, network.head
    kind = type(cell).__name__
    order = np.concatenate([np.arange(g * MEMORY, (g + 1) * MEMORY) for g in GATES[kind]])
    given, kept = (numbers(w)[order] for w in (cell.weight_ih_l0, cell.weight_hh_l0))
    biases = [numbers(b)[order] for b in (cell.bias_ih_l0, cell.bias_hh_l0)]
    weights = arrays({"w": given[None], "r": kept[None], "b": np.concatenate(biases)[None]})
    weights += arrays({"head": head.weight, "shift": head.bias})
    weights += arrays({"axes": np.array([0, 1], dtype=np.int64)})
    states = ["hidden", "cell"] if kind == "LSTM" else ["hidden"]
    new = [f"new_{name}" for name in states]
    inputs = ["input", "w", "r", "b", "", *states]
    nodes = [
        helper.make_node(kind, inputs, ["all", *new], hidden_size=MEMORY, **options),
        helper.make_node("Squeeze", ["all", "axes"], ["last"]),
        helper.make_node("Gemm", ["last", "head", "shift"], ["output"], transB=1),
    ]
    shape = [1, "worlds", MEMORY]
    ends = (
        [("input", [1, "worlds", columns]), *((name, shape) for name in states)],
        [("output", ["worlds", 1]), *((name, shape) for name in new)],
    )
    save(path, nodes, weights, ends, meta)


def numbers(tensor: Any) -> Any:
    """Return a tensor or array as numpy."""
    return tensor.detach().numpy() if isinstance(tensor, torch.Tensor) else tensor


def arrays(named: dict[str, Any]) -> list[Any]:
    """Return weights as ONNX keeps them."""
    from onnx import numpy_helper

    return [numpy_helper.from_array(numbers(value), name=name) for name, value in named.items()]


def save(
    path: Path,
    nodes: list[Any],
    weights: list[Any],
    ends: tuple[list[Any], list[Any]],
    meta: dict[str, Any],
) -> None:
    """Check and write an ONNX file with its metadata.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    import onnx
    from onnx import TensorProto, helper

    given, answered = (
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in rows]
        for rows in ends
    )
    graph = helper.make_graph(nodes, path.stem, given, answered, initializer=weights)
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION
    )
    model.metadata_props.add(key=METADATA, value=json.dumps(meta))
    onnx.checker.check_model(model)
    write_bytes(path, model.SerializeToString())


class ScaledLstm(torch.nn.Module):
    """An LSTM with its scales inside: Isaac Lab has no numbers for them.

    `lstm` is where Isaac Lab looks for the size of the memory.
    """

    scale: torch.Tensor

    def __init__(self, network: StudentMemory, scales: Scales) -> None:
        super().__init__()
        self.lstm, self.head = network.memory, network.head
        self.register_buffer("scale", torch.tensor(scales[:2], dtype=torch.float32))
        self.effort_scale = float(scales[2])

    def forward(
        self, x: torch.Tensor, state: tuple[torch.Tensor, torch.Tensor]
    ) -> tuple[torch.Tensor, tuple[torch.Tensor, torch.Tensor]]:
        """Return efforts, shape (N, T, 1), and the new state."""
        out, state = self.lstm(x * self.scale, state)
        return self.effort_scale * self.head(out), state


def write_torchscript(path: Path, network: torch.nn.Module) -> None:
    """Write a network as TorchScript.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    import warnings

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=DeprecationWarning)
        scripted: Any = torch.jit.script(network.eval())
        write_bytes(path, scripted.save_to_buffer())
