"""Models that would take the machine down, or look into other files: refused, quickly, by name."""

import json
import os
import random
from collections.abc import Callable
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from tendon_hardware.control.goals import LineGoals, parse_goal, read_goals
from tendon_hardware.control.keyboard import split_keys
from tendon_hardware.control.onnx_operators import refuse_operators
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.safety_rules.force_estimate import load_estimate
from tendon_hardware.virtual_bench import Faults
from tendon_newton.actuators.networks.onnx_file import write_onnx
from tendon_newton.data.cards.policy_card import CARD_KEY, PolicyCard
from tendon_newton.errors import InvalidNetworkFile, InvalidPolicyFile, TendonNewtonError
from tendon_newton.force_networks import FORCE_NETWORKS, SETS, build_network
from tests.bad_input.memory import peak_memory
from tests.bad_input.spoiling import flip
from tests.hardware.deploy.policies import card_of
from tests.hardware.deploy.runs import Flight
from tests.train.actuator.network_files import card_of as force_card_of

QUICK = 30.0  # Longest answer by the clock [s], on a busy machine; alone it takes 1 to 5 s
MEMORY = 300 << 20  # Most that a refusal may take in the parent [bytes]


def model_of(path: Path, nodes: list, weights: dict[str, np.ndarray]) -> Path:
    """Write a policy of some operations, from ``obs`` to ``action``."""
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, 150])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, None)],
        [numpy_helper.from_array(values, name) for name, values in weights.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    model.metadata_props.add(key=CARD_KEY, value=card_of().to_json())
    path.write_bytes(model.SerializeToString())
    return path


def outer_product(path: Path) -> Path:
    """A column times a row of 40,000 numbers each: 6.4 GB out of 0.3 MB."""
    nodes = [
        helper.make_node("ReduceSum", ["obs"], ["sum"]),
        helper.make_node("Mul", ["column", "sum"], ["tall"]),
        helper.make_node("MatMul", ["tall", "row"], ["huge"]),
        helper.make_node("ReduceSum", ["huge"], ["action"]),
    ]
    line = np.ones(40_000, dtype=np.float32)
    return model_of(path, nodes, {"column": line[:, None], "row": line[None]})


def constant_of_shape(path: Path) -> Path:
    """Nine gigabytes of ones, by a shape of two numbers."""
    nodes = [
        helper.make_node("ConstantOfShape", ["shape"], ["huge"]),
        helper.make_node("ReduceSum", ["huge"], ["action"]),
    ]
    return model_of(path, nodes, {"shape": np.array([50_000, 50_000], dtype=np.int64)})


def turns(operator: str = "Loop") -> onnx.NodeProto:
    """Return an operator with a graph of its own, which a count of turns may repeat."""
    body = helper.make_graph(
        [helper.make_node("Identity", ["on"], ["go"]), helper.make_node("Sin", ["x"], ["y"])],
        "body",
        [
            helper.make_tensor_value_info("turn", TensorProto.INT64, []),
            helper.make_tensor_value_info("on", TensorProto.BOOL, []),
            helper.make_tensor_value_info("x", TensorProto.FLOAT, None),
        ],
        [
            helper.make_tensor_value_info("go", TensorProto.BOOL, []),
            helper.make_tensor_value_info("y", TensorProto.FLOAT, None),
        ],
    )
    return helper.make_node(operator, ["count", "yes", "sum"], ["action"], body=body)


def loop_of_an_angle(path: Path, operator: str = "Loop") -> Path:
    """Billions of turns where the spool is somewhere else than in a trial."""
    nodes = [
        helper.make_node("ReduceSum", ["obs"], ["sum"]),
        helper.make_node("Cast", ["sum"], ["count"], to=TensorProto.INT64),
        turns(operator),
    ]
    return model_of(path, nodes, {"yes": np.array(True)})


def loop_in_a_function(path: Path) -> Path:
    """A loop behind the name of a plain operator, whose definition the file brings along."""
    model_of(path, [helper.make_node("Sigmoid", ["obs"], ["action"])], {})
    model = onnx.load(path)
    opsets = [helper.make_opsetid("", 17)]
    named = ["count", "yes", "sum"]
    model.functions.append(
        helper.make_function("", "Sigmoid", named, ["action"], [turns()], opsets)
    )
    path.write_bytes(model.SerializeToString())
    return path


def operator_of_others(path: Path) -> Path:
    """An operator that some build of onnxruntime may have."""
    node = helper.make_node("Sigmoid", ["obs"], ["action"], domain="com.microsoft")
    return model_of(path, [node], {})


def size_of_an_angle(path: Path, operator: str) -> Path:
    """A tensor as large as an angle says: made, repeated, or cut from one of ours."""
    sliced = {"ConstantOfShape": ["size"], "Slice": ["row", "zero", "size"]}
    given = sliced.get(operator, ["row", "size"])
    nodes = [
        helper.make_node("ReduceSum", ["obs", "axes"], ["sum"], keepdims=0),
        helper.make_node("Cast", ["sum"], ["size"], to=TensorProto.INT64),
        helper.make_node(operator, given, ["x"]),
        helper.make_node("ReduceSum", ["x"], ["action"]),
    ]
    weights = {
        "row": np.ones(40_000, dtype=np.float32),
        "zero": np.zeros(1, dtype=np.int64),
        "axes": np.array([1], dtype=np.int64),
    }
    return model_of(path, nodes, weights)


def other_format(path: Path) -> Path:
    """A file that onnxruntime takes for one of its own format, by its first bytes."""
    path.write_bytes(b"\x18\0\0\0ORTM" + bytes(100))
    return path


def foreign_weights(path: Path, place: str) -> Path:
    """Weights that stand in a file of the machine."""
    nodes = [helper.make_node("MatMul", ["obs", "weights"], ["action"])]
    model_of(path, nodes, {"weights": np.ones((150, 1), dtype=np.float32)})
    model = onnx.load(path)
    (tensor,) = model.graph.initializer
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value=place)
    path.write_bytes(model.SerializeToString())
    return path


# how a model is made -> what is said
BOMBS: dict[str, tuple[Callable[[Path], Path], str]] = {
    "an outer product": (outer_product, "takes more than 1024 MiB of memory"),
    "a constant of a shape": (constant_of_shape, "takes more than 1024 MiB of memory"),
    "a loop of an angle": (loop_of_an_angle, "plain arithmetic.* 'Loop'"),
    "a scan": (lambda path: loop_of_an_angle(path, "Scan"), "plain arithmetic.* 'Scan'"),
    "a plain name with a graph": (
        lambda path: loop_of_an_angle(path, "Identity"),
        "plain arithmetic.* 'Identity'",
    ),
    "a loop in a function": (loop_in_a_function, "without functions of its own"),
    "an operator of others": (operator_of_others, "plain arithmetic.* 'Sigmoid'"),
    "another format": (other_format, "its bytes are no message|has no operators|it is cut off"),
    **{
        f"{operator} of an angle": (
            lambda path, operator=operator: size_of_an_angle(path, operator),
            f"those of {operator} do|'{operator}'",
        )
        for operator in ("ConstantOfShape", "Expand", "Slice", "Tile", "Reshape")
    },
    "weights of a system file": (
        lambda path: foreign_weights(path, "/etc/passwd"),
        "weights stand in another file",
    ),
    "weights beside it": (
        lambda path: foreign_weights(path, "policy.onnx"),
        "weights stand in another file",
    ),
}


@pytest.mark.parametrize("case", BOMBS)
def test_a_model_bomb_ends_a_child_and_not_the_machine(case: str, tmp_path: Path) -> None:
    """As a policy and as a force network, with one line that says what it did."""
    make, said = BOMBS[case]
    path = make(tmp_path / "policy.onnx")
    assert path.stat().st_size < 500_000
    began = monotonic()
    with peak_memory() as peak:
        with pytest.raises(InvalidPolicyFile, match=rf"policy\.onnx: .*({said})"):
            load_policy(path)
        with pytest.raises(InvalidNetworkFile, match=r"policy\.onnx: "):
            load_estimate(path, 20.0)
    assert monotonic() - began < QUICK
    assert peak.size < MEMORY


@pytest.mark.parametrize(("of_set", "kind"), [(s, k) for s in SETS for k in FORCE_NETWORKS])
def test_networks_that_we_write_are_plain_arithmetic(of_set, kind, tmp_path) -> None:
    """Of every kind; no list of operators may leave out one of ours."""
    network = build_network(kind, of_set=of_set, window=30).eval()
    write_onnx(tmp_path / "net.onnx", network, force_card_of(kind))
    refuse_operators((tmp_path / "net.onnx").read_bytes())


def test_broken_cards_are_refused_or_still_true() -> None:
    """Of 600 broken cards each is refused, or is a card that keeps every promise."""
    rng = random.Random(1)
    text = card_of().to_json()
    table = json.loads(text)
    values = (None, True, -1, 0, 1e308, "x", [], {}, [[]], "9" * 5000, 10**400, float("nan"))
    for count in range(600):
        if count % 2:
            key = rng.choice(list(table))
            broken = json.dumps(table | {key: rng.choice(values)})
        else:
            broken = flip(text.encode(), rng).decode("utf-8", errors="replace")
        try:
            card = PolicyCard.from_json(broken)
        except TendonNewtonError:
            continue
        assert PolicyCard.from_json(card.to_json()) == card


def test_broken_goals_change_nothing(tmp_path: Path) -> None:
    """Of 570 broken lines, files and keys each gives a number, an error of ours, or nothing."""
    rng = random.Random(2)
    for _ in range(270):
        line = flip(b"0.7854", rng).decode("latin-1")
        try:
            assert np.isfinite(parse_goal(line))
        except TendonNewtonError:
            continue
    path = tmp_path / "goals.txt"
    for _ in range(100):
        path.write_bytes(flip(b"0 0.1\n1.5, 0.9\n3 0\n# end\n", rng))
        try:
            read_goals(path)
        except TendonNewtonError:
            continue
    read_end, write_end = os.pipe()
    goals = LineGoals(0.3, read_end)
    for _ in range(200):
        os.write(write_end, flip(b"0.5\n0.7\n", rng))
        assert np.isfinite(goals.value(0.0))
        split_keys(flip(b"\x1b[A\x1b[B q5", rng))
    assert len(goals.notes) <= 1, "a flood of nonsense is told once"
    os.close(read_end)
    os.close(write_end)


@pytest.mark.parametrize("count", [8, pytest.param(30, marks=pytest.mark.slow)])
def test_broken_serial_streams_never_move_the_spool_out_of_its_limits(count: int) -> None:
    """Answers dropped, broken and drowned in noise, and the same for the load cell's lines."""
    rng = random.Random(3)
    for _ in range(count):
        worst = Faults(
            dropped_replies=rng.uniform(0.0, 0.4),
            corrupted_replies=rng.uniform(0.0, 0.4),
            line_noise=rng.uniform(0.0, 0.6),
            garbled_lines=rng.uniform(0.0, 0.9),
            lost_lines=rng.uniform(0.0, 0.5),
            extra_latency=rng.choice((0.0, 0.002, 0.01)),
        )
        angles: list[float] = []

        def spoil(bench, stop, worst=worst) -> None:
            bench.controls.set_faults(worst)

        flight = Flight(settings=DeploySettings(duration=2.0), fault=spoil, after=0.3)

        def show(progress: Any, angles: list[float] = angles) -> None:
            angles.extend(progress.position)

        flight.operator.show = show
        flight.fly()
        assert not flight.torque_after or any("SUPPLY OFF" in t for t in flight.operator.told)
        assert -0.1 < flight.angle_after < 1.5
        assert all(-0.1 < angle < 1.5 for angle in angles)
