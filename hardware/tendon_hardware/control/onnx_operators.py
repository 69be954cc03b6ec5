"""What a network from an ONNX file may do: a fixed piece of arithmetic, whatever it is shown.

A trial tells how long a network takes and how much memory only if neither depends on the numbers
that come in. Operators are therefore those of a list without loops and branches, and the sizes of
all tensors follow from constants and from the sizes of others.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from tendon_newton.errors import InvalidPolicyFile, shown

FREE = """
    Abs Acos Add And ArgMax ArgMin Asin Atan AveragePool BatchNormalization Cast Ceil Celu Clip
    Concat Constant Conv Cos Cosh CumSum Div Dropout Einsum Elu Equal Erf Exp Flatten Floor GRU
    Gather GatherElements GatherND Gelu Gemm GlobalAveragePool GlobalMaxPool Greater
    GreaterOrEqual HardSigmoid HardSwish Identity InstanceNormalization IsInf IsNaN LSTM
    LayerNormalization LeakyRelu Less LessOrEqual Log LogSoftmax MatMul Max MaxPool Mean Min
    Mish Mod Mul Neg Not Or PRelu Pow RMSNormalization RNN Reciprocal Relu Round ScatterElements
    ScatterND Selu Shape Sigmoid Sign Sin Sinh Size Softmax Softplus Softsign Sqrt Sub Sum Swish
    Tan Tanh ThresholdedRelu Transpose Trilu Where Xor
"""
"""Operators whose output has a size that follows from the sizes of their inputs."""
SIZED = """
    ConstantOfShape Expand Pad ReduceL1 ReduceL2 ReduceMax ReduceMean ReduceMin ReduceProd ReduceSum
    ReduceSumSquare Reshape Slice Split Squeeze Tile Unsqueeze
"""
"""Operators of which all inputs but the first may decide a size; of the first one that makes it."""
WHOLE = "ConstantOfShape"
STANDARD = (b"", b"ai.onnx")  # Domains of ONNX's own operators
# numbers of fields in ONNX's messages
GRAPH, FUNCTIONS = 7, 25  # of a model
NODE, INITIALIZER = 1, 5  # of a graph
INPUT, OUTPUT, OPERATOR, ATTRIBUTE, DOMAIN = 1, 2, 4, 5, 7  # of a node
SUBGRAPHS = (6, 11)  # of an attribute
NAME = 8  # of a tensor
WIDTHS = {1: 8, 5: 4}  # Bytes of a field by its kind


@dataclass(frozen=True, kw_only=True)
class Node:
    """One operation of a graph."""

    operator: str
    inputs: tuple[bytes, ...]
    outputs: tuple[bytes, ...]


def refuse_operators(content: bytes) -> None:
    """Refuse a network whose time or memory may depend on what it is shown.

    Raises:
        InvalidPolicyFile: The bytes are no ONNX, or hold an operator, a function or a part of
            another kind, or a size that is computed from an input.
    """
    model = list(fields(content))
    if any(number == FUNCTIONS for number, _ in model):
        raise InvalidPolicyFile("a network without functions of its own; this one has some")
    graphs = [value for number, value in model if number == GRAPH]
    parts = [part for graph in graphs for part in fields(graph)]
    known = {
        name
        for number, tensor in parts
        if number == INITIALIZER
        for field, name in fields(tensor)
        if field == NAME
    }
    nodes = [read_node(value) for number, value in parts if number == NODE]
    if not nodes:
        raise InvalidPolicyFile("an ONNX file with a network; it has no operators")
    for node in nodes:
        sizes = node.inputs if node.operator == WHOLE else node.inputs[1:]
        if node.operator in SIZED.split() and not known.issuperset(sizes):
            raise InvalidPolicyFile(
                f"a network with sizes that do not depend on its input; those of {node.operator} do"
            )
        if node.operator in ("Shape", "Size") or known.issuperset(node.inputs):
            known.update(node.outputs)


def read_node(content: bytes) -> Node:
    """Read a node of the list."""
    parts = list(fields(content))
    named = {key: [value for number, value in parts if number == key] for key in range(1, 9)}
    operator = named[OPERATOR][-1].decode("utf-8", "replace") if named[OPERATOR] else ""
    domain = named[DOMAIN][-1] if named[DOMAIN] else b""
    nested = any(part in SUBGRAPHS for each in named[ATTRIBUTE] for part, _ in fields(each))
    if domain not in STANDARD or operator not in (FREE + SIZED).split() or nested:
        raise InvalidPolicyFile(
            "a network of plain arithmetic, without loops, branches and operators of others; this "
            f"one has {shown(operator)}"
        )
    inputs = tuple(filter(None, named[INPUT]))  # an optional one that is left out has no name
    return Node(operator=operator, inputs=inputs, outputs=tuple(named[OUTPUT]))


def fields(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield numbers and contents of a message's fields; what is no text or message is empty."""
    place = 0
    while place < len(content):
        key, place = varint(content, place)
        number, kind = key >> 3, key & 7
        value = b""
        if kind == 0:
            _, place = varint(content, place)
        elif kind == 2:
            size, place = varint(content, place)
            value, place = content[place : place + size], place + size
        elif kind in WIDTHS:
            place += WIDTHS[kind]
        else:
            raise InvalidPolicyFile(
                "a policy is an ONNX or TorchScript file; its bytes are no message"
            )
        if place > len(content):
            raise InvalidPolicyFile("an ONNX file; it is cut off")
        yield number, value


def varint(content: bytes, place: int) -> tuple[int, int]:
    """Return a number of a message, and where the next thing begins."""
    number = 0
    for shift in range(0, 70, 7):
        if place >= len(content):
            break
        byte = content[place]
        place += 1
        number |= (byte & 127) << shift
        if byte < 128:
            return number, place
    raise InvalidPolicyFile("a policy is an ONNX or TorchScript file; its bytes are no message")
