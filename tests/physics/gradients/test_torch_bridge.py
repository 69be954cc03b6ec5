"""Torch and Warp on one memory, and a control step as a graph."""

import re
from pathlib import Path

import pytest
import torch
import warp as wp

from tendon_newton.data.model_file import Model
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.hosts.torch_bridge import WARM_UPS, Graph, plain_tensor
from tests.conftest import SEED
from tests.physics.learned.networks import EFFECTS, force_query, learned_model
from tests.physics.runs import ideal_model


@wp.kernel
def add_kernel(source: wp.array(dtype=float), total: wp.array(dtype=float)) -> None:
    """Add one array to another."""
    i = wp.tid()
    total[i] += source[i]


def test_a_graph_does_what_the_launches_did() -> None:
    """Eager runs and replays add up; what torch writes between them counts."""
    source, total = (wp.zeros(4, dtype=float, device="cpu") for _ in range(2))
    graph = Graph(
        lambda: wp.launch(add_kernel, 4, inputs=[source], outputs=[total], device="cpu"),
        source.device,
    )
    for step in range(2 * WARM_UPS):
        plain_tensor(source).fill_(float(step))
        graph()
    assert total.numpy().tolist() == [sum(range(2 * WARM_UPS))] * 4


def test_tensors_are_the_arrays_themselves() -> None:
    """What is read, written and randomised passes no copy."""
    loop = ControlLoop(load_mechanism("finger"), ideal_model(), 2, device="cpu")
    assert loop.reading.force.data_ptr() == loop.solver.force.ptr
    assert loop.bench_numbers("mass").data_ptr() == loop.solver.bench_numbers("mass").ptr
    assert loop.numbers("ideal", "gain").data_ptr() == loop.solver.parameters.ptr


def follow(model: Model, device: str, steps: int = 20) -> torch.Tensor:
    """Return the motor angles of some worlds under random commands, shape (steps, W, 1)."""
    query = None
    if model.actuator.name == "learned":
        query = force_query()
        query.module.to(device)
    loop = ControlLoop(load_mechanism("finger"), model, 8, network=query, device=device)
    generator = torch.Generator().manual_seed(SEED)
    commands = (1.0 + 3.0 * torch.rand(steps, 8, 1, generator=generator)).to(device)
    loop.reset(commands[0])
    return torch.stack([loop.step(c).motor_position.clone() for c in commands]).cpu()


@pytest.mark.gpu
@pytest.mark.parametrize("kind", ["ideal", "learned"])
def test_one_graph_on_cuda_is_the_loop_on_the_cpu(kind: str) -> None:
    """Torch's network and Warp's kernels captured together: to float32 rounding in closed loop."""
    model = ideal_model() if kind == "ideal" else learned_model(**EFFECTS)
    torch.testing.assert_close(follow(model, "cuda:0"), follow(model, "cpu"), rtol=0.0, atol=1e-3)


PAGE = Path(__file__).resolve().parents[3] / "docs" / "gradients.md"


@pytest.mark.slow
def test_the_block_of_the_page_finds_the_numbers_that_it_says(capsys) -> None:
    """The page's Python, run as it stands, prints the answer below it."""
    text = PAGE.read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (answer,) = re.findall(r"The answer is ([\d.]+) N/rad and ([\d.]+) N\.", text)
    exec(block, {})
    assert capsys.readouterr().out.splitlines()[-1] == "{} N/rad, {} N".format(*answer)
