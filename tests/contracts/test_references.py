"""Large arguments of device functions are passed by reference where they are only read."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from tendon_newton.device_code.placeholders import JOINTS, OFFSETS, DeviceArray, JointMatrix, real
from tendon_newton.device_code.references import by_reference, is_large, written_places
from tendon_newton.device_code.templates import (
    Bindings,
    Specialiser,
    device_struct,
    device_template,
)
from tendon_newton.errors import InvalidDeviceCode


@device_struct
class Bench:
    """A struct with numbers and an array."""

    mass: real  # [kg]
    masses: DeviceArray[real]  # Of all benches [kg]


@device_template
def doubled(bench: Bench) -> Bench:
    """Copy a bench and write the copy."""
    out = bench
    out.mass = real(2.0) * bench.mass
    return out


@device_template
def emptied(bench: Bench) -> real:
    """Write an argument."""
    bench.mass = real(0.0)
    return bench.mass


@device_template
def noted(bench: Bench, i: int) -> real:
    """Write an item of an array."""
    bench.masses[i] = bench.mass
    return bench.mass


@device_template
def swapped(bench: Bench, other: Bench) -> real:
    """Write arguments as parts of a tuple."""
    bench, other.mass = other, bench.mass
    return bench.mass


@device_template
def twice(bench: Bench) -> Bench:
    """Pass the result of a call."""
    return doubled(doubled(bench))


@device_template
def weigh_kernel(bench: Bench, out: DeviceArray[real]) -> None:
    """Call all of them; none may change the bench of the caller."""
    own = bench
    more = doubled(own)
    out[0] = own.mass
    out[1] = more.mass
    out[2] = emptied(own)
    out[3] = own.mass
    out[4] = noted(own, 0)


@device_template
def offset_kernel(out: DeviceArray[real]) -> None:
    """Read a table of numbers that are bound."""
    for d in range(wp.static(JOINTS)):
        out[d] = real(wp.static(OFFSETS[d]))


def bindings() -> Bindings:
    """Return the types of these tests."""
    return Bindings({real: wp.float64, JointMatrix: wp.types.matrix((4, 4), wp.float64)})


def test_only_what_is_large_and_read_is_passed_by_reference() -> None:
    """A function that writes an argument has a copy of it, as in Python's own numbers."""
    bench = bindings()[Bench]
    assert by_reference(doubled, {"bench": bench, "return": bench}) == {
        "bench": wp.ref[bench],
        "return": bench,
    }
    assert by_reference(emptied, {"bench": bench})["bench"] is bench
    assert by_reference(noted, {"bench": bench, "i": int}) == {"bench": wp.ref[bench], "i": int}
    assert is_large(bindings()[JointMatrix])
    assert not is_large(wp.vec3d)
    assert by_reference(swapped, {"bench": bench, "other": bench}) == {
        "bench": bench,
        "other": bench,
    }
    assert written_places(noted) == {("bench", "masses")}


def test_no_callee_changes_what_its_caller_has() -> None:
    """References are for reading: the numbers are those of copies."""
    types = bindings()
    kernel = Specialiser(types, references=True).kernel(
        weigh_kernel, "references", enable_backward=False
    )
    given = types[Bench]()
    given.mass = 3.0
    given.masses = wp.zeros(1, dtype=wp.float64, device="cpu")
    out = wp.zeros(5, dtype=wp.float64, device="cpu")
    wp.launch(kernel, 1, inputs=[given, out], device="cpu")
    np.testing.assert_array_equal(out.numpy(), [3.0, 6.0, 0.0, 3.0, 3.0])
    assert given.masses.numpy()[0] == 3.0


def test_kernels_that_differ_in_a_bound_number_have_names_of_their_own() -> None:
    """Warp's cache knows a kernel by its name and text: it would run one for the other."""

    def name(offsets: tuple[int, ...]) -> str:
        bound = Bindings({real: wp.float64, JOINTS: len(offsets), OFFSETS: offsets})
        return Specialiser(bound).kernel(offset_kernel, "offsets").key

    assert name((3, 5)) == name((3, 5)) != name((3, 6))


def test_the_result_of_a_call_is_refused_in_one_line() -> None:
    """It has no place in memory; the message says what to do, and has no word of Warp's."""
    with pytest.raises(
        InvalidDeviceCode,
        match=r"^twice gives doubled\(bench\) to doubled as bench, .* first \(.*:\d+\)$",
    ):
        Specialiser(bindings(), references=True).function(twice)
