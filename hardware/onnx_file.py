"""ONNX files read without the packages onnx and onnxruntime: nodes, weights and metadata.

Source of the field numbers: onnx.proto of ONNX 1.23; of protobuf's wire format three kinds occur:
variable integers (0), eight bytes (1), bytes with their length (2) and four bytes (5). A field that
is not listed here is left out; a file whose weights stand in other files is refused.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tendon_newton.errors import InvalidPolicyFile, shown

VARINT, EIGHT_BYTES, LENGTH, FOUR_BYTES = 0, 1, 2, 5
VARINT_BITS = 70
"""Ten bytes of seven bits, more than which no integer has."""
TYPES: Mapping[int, str] = {1: "<f4", 6: "<i4", 7: "<i8", 11: "<f8"}
"""ONNX's number of an element's type -> NumPy's."""
ELEMENTS_MAX = 1 << 24
"""Numbers in one tensor; the greatest of a policy has 150 x 128."""
EXTERNAL = 1
"""Place of a tensor whose bytes stand in another file."""

Attribute = float | int | bytes | NDArray[Any]
Fields = dict[int, list[Any]]


@dataclass(frozen=True, kw_only=True)
class Node:
    """One operation of a graph."""

    operation: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    attributes: Mapping[str, Attribute]


@dataclass(frozen=True, kw_only=True)
class OnnxFile:
    """What of an ONNX file a policy needs."""

    nodes: tuple[Node, ...]
    """In an order in which they can be run."""
    weights: Mapping[str, NDArray[Any]]
    inputs: tuple[str, ...]
    """Names of what must be given."""
    outputs: tuple[str, ...]
    metadata: Mapping[str, str]


def parse_onnx(content: bytes) -> OnnxFile:
    """Read an ONNX file.

    Raises:
        InvalidPolicyFile: The bytes are no ONNX file, or it is damaged.
    """
    try:
        model = fields_of(content)
        graph = fields_of(one(model, 7, "a graph"))
        weights = dict(read_tensor(item) for item in graph.get(5, ()))
        return OnnxFile(
            nodes=tuple(read_node(item) for item in graph.get(1, ())),
            weights=weights,
            inputs=tuple(
                name for item in graph.get(11, ())
                if (name := text(fields_of(item), 1)) not in weights
            ),
            outputs=tuple(text(fields_of(item), 1) for item in graph.get(12, ())),
            metadata={
                text(entry, 1): text(entry, 2) for entry in map(fields_of, model.get(14, ()))
            },
        )  # fmt: skip
    except (IndexError, KeyError, TypeError, ValueError, struct.error) as error:
        raise InvalidPolicyFile(f"an ONNX file that is whole; this one is damaged: {error}") from (
            error
        )


def fields_of(data: Any) -> Fields:
    """Return the values of a message by field number, in order."""
    if not isinstance(data, bytes):
        raise TypeError("a message is needed where a number stands")
    fields: Fields = {}
    for number, value in read_fields(data):
        fields.setdefault(number, []).append(value)
    return fields


def read_fields(data: bytes) -> Iterator[tuple[int, Any]]:
    """Give field numbers and values one after the other."""
    place = 0
    while place < len(data):
        key, place = read_varint(data, place)
        number, kind = key >> 3, key & 7
        if kind == VARINT:
            value, place = read_varint(data, place)
        elif kind in (EIGHT_BYTES, LENGTH, FOUR_BYTES):
            size = {EIGHT_BYTES: 8, FOUR_BYTES: 4}.get(kind, 0)
            if kind == LENGTH:
                size, place = read_varint(data, place)
            if place + size > len(data):
                raise ValueError(f"a field of {size} bytes ends after the file")
            value, place = data[place : place + size], place + size
        else:
            raise ValueError(f"no field has the kind {kind}")
        yield number, value


def read_varint(data: bytes, place: int) -> tuple[int, int]:
    """Read an integer of seven bits a byte; return it and the place after it."""
    value = 0
    for shift in range(0, VARINT_BITS, 7):
        byte = data[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if not byte & 0x80:
            return value, place
    raise ValueError("an integer has more than ten bytes")


def read_node(data: Any) -> Node:
    """Read an operation."""
    fields = fields_of(data)
    return Node(
        operation=text(fields, 4),
        inputs=tuple(decoded(name) for name in fields.get(1, ())),
        outputs=tuple(decoded(name) for name in fields.get(2, ())),
        attributes=dict(read_attribute(item) for item in fields.get(5, ())),
    )


def read_attribute(data: Any) -> tuple[str, Attribute]:
    """Read a setting of an operation: a number, a word, whole numbers or a tensor."""
    fields = fields_of(data)
    name = text(fields, 1)
    if 2 in fields:
        return name, struct.unpack("<f", fields[2][0])[0]
    if 3 in fields:
        return name, signed(fields[3][0])
    if 5 in fields:
        return name, read_tensor(fields[5][0])[1]
    if 8 in fields:
        return name, np.array([signed(value) for value in integers(fields, 8)], dtype=np.int64)
    value = fields.get(4, [b""])[0]
    return name, value if isinstance(value, bytes) else b""


def read_tensor(data: Any) -> tuple[str, NDArray[Any]]:
    """Read a tensor with its name."""
    fields = fields_of(data)
    name = text(fields, 8)
    if EXTERNAL in fields.get(14, ()):
        raise InvalidPolicyFile(
            f"one file with everything in it; the weights {shown(name)} stand in another file: "
            "export with external_data=False"
        )
    kind = one(fields, 2, "a type of element")
    if kind not in TYPES:
        raise ValueError(f"tensor {shown(name)} has elements of the unknown type {shown(kind)}")
    shape = tuple(integers(fields, 1))
    count = 1
    for length in shape:
        count *= length
        if count > ELEMENTS_MAX:
            raise ValueError(f"tensor {shown(name)} has more than {ELEMENTS_MAX} elements")
    if 9 in fields:
        values = np.frombuffer(fields[9][0], dtype=TYPES[kind])
    elif kind == 1:
        values = np.frombuffer(b"".join(fields.get(4, ())), dtype="<f4")
    else:
        values = np.array(
            [signed(value) for value in integers(fields, 7 if kind == 7 else 5)], dtype=TYPES[kind]
        )
    array = values.reshape(shape)
    array.setflags(write=False)
    return name, array


def integers(fields: Fields, number: int) -> list[int]:
    """Return whole numbers, which may stand one by one or packed."""
    found: list[int] = []
    for value in fields.get(number, ()):
        place = 0
        if isinstance(value, int):
            found.append(value)
            continue
        while place < len(value):
            integer, place = read_varint(value, place)
            found.append(integer)
    return found


def signed(value: int) -> int:
    """Return an integer of 64 bits with its sign."""
    return value - (1 << 64) if value >= 1 << 63 else value


def one(fields: Fields, number: int, what: str) -> Any:
    """Return the only value that a field may have."""
    if number not in fields:
        raise ValueError(f"{what} is missing")
    return fields[number][-1]


def text(fields: Fields, number: int) -> str:
    """Return a field's text, empty where there is none."""
    return decoded(fields.get(number, [b""])[-1])


def decoded(value: Any) -> str:
    """Return bytes as text."""
    if not isinstance(value, bytes):
        raise TypeError("text is needed where a number stands")
    return value.decode("utf-8")
