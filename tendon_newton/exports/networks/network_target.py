"""Export of a servo as networks that other simulators' drives run."""

from pathlib import Path

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.effects import EFFECTS
from tendon_newton.exports.export_target import Coverage, Exported, ExportTarget
from tendon_newton.exports.model_numbers import refuse_damaged
from tendon_newton.exports.networks import files, students
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

MLP_STEPS, MEMORY_STEPS = 1500, 600  # Steps of training
MLP_FILES, LSTM_FILES = ("mlp.onnx", "mlp.pt"), ("lstm.onnx", "lstm.pt")
GRU_FILE = "gru.onnx"
# What a servo and its tendon do is learned; the mechanism and the load cell are not
COVERAGE: dict[str, Coverage] = {
    name: "approximate" if effect.side in ("actuator", "transmission") else "none"
    for name, effect in EFFECTS.items()
}


def write_networks_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write networks of the servo's force: an MLP, an LSTM and a GRU.

    Raises:
        InvalidModelFile: The model has no force.
        InvalidOutput: A file cannot be written.
    """
    refuse_damaged(model, "a network")
    lessons = students.lessons_of(mechanism, model)
    scales = lessons.scales
    mlp, mlp_error = students.fit_mlp(lessons, steps=MLP_STEPS)
    lstm, lstm_error = students.fit_lstm(lessons, steps=MEMORY_STEPS)
    gru, gru_error = students.fit_gru(lessons, steps=MEMORY_STEPS)
    files.write_gru_onnx(folder / GRU_FILE, gru, lessons.spread)
    files.write_mlp_onnx(folder / MLP_FILES[0], mlp, scales)
    files.write_torchscript(folder / MLP_FILES[1], mlp)
    files.write_lstm_onnx(folder / LSTM_FILES[0], lstm, scales)
    files.write_torchscript(folder / LSTM_FILES[1], files.ScaledLstm(lstm, scales))
    return Exported(
        files=tuple(folder / name for name in (*MLP_FILES, *LSTM_FILES, GRU_FILE)),
        loading=loading_text(
            scales,
            {"MLP": mlp_error, "LSTM": lstm_error, "GRU": gru_error},
            learned=find_actuator(model.actuator.name).held,
        ),
        checked=CHECKED,
        left_out={"networks": tuple(e.name for e in model.effects if COVERAGE[e.name] == "none")},
    )


def loading_text(
    scales: tuple[float, float, float], errors: dict[str, float], *, learned: bool
) -> str:
    """Return how a user loads the files, and how far their forces stray."""
    rows = "\n".join(f"| {name} | {error:.4f} N |" for name, error in errors.items())
    told = NO_TRANSFORMER if learned else ""
    pos, vel, effort = scales
    rate = students.RATE
    return f"""{told}The MLP and the LSTM are shown the motor's position error [rad] and
speed [rad/s], the GRU its command, angle and speed. The answer is the force at the string [N]. Ask
a network {rate:g} times per second. In a joint's terms, multiply `pos_scale` and `vel_scale` by
motor angle per joint position, and the effort by the moment arm. The GRU's means and standard
deviations are divided by that ratio in place of it.

| network | force error on {students.HELD_OUT} runs that it has not seen |
|---|---|
{rows}

Newton reads the ONNX files (`NewtonNeuralControlAPI`, `newton:modelPath`); their metadata says
order, history and scales. It needs `newton[onnx]`, and the GRU steps of {1e3 / rate:g} ms.

Isaac Lab and mjlab read the TorchScript files. The scales are inside `lstm.pt`; of `mlp.pt`:

```python
ActuatorNetMLPCfg(
    network_file="mlp.pt",
    pos_scale={pos:.8g},
    vel_scale={vel:.8g},
    torque_scale={effort:.8g},
    input_order="pos_vel",
    input_idx=list(range({students.HISTORY})),
    ...
)
```

mjlab's `LearnedMlpActuatorCfg` has `history_length={students.HISTORY}` in place of `input_idx`.
"""


CHECKED = """The table above says how far forces stray on runs that the networks have not seen.
Newton's drives and TorchScript make the same of the files, to 2e-6 N."""
NO_TRANSFORMER = """These programs take no Transformer. So here are an MLP, an LSTM and a GRU,
which have learned the force of this model's network on commands of their own.

"""

NETWORKS = ExportTarget(coverage=COVERAGE, write=write_networks_target)
