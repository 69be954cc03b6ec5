"""What effects are given in each stage: as the table says, and nothing else is read."""

import ast
import inspect
import re
from collections.abc import Iterator
from types import ModuleType

import pytest

from tendon_newton.device_code.placeholders import Jet, Values
from tendon_newton.device_code.structs import Joint, Tendon
from tendon_newton.device_code.templates import Bindings, Specialiser, device_template
from tendon_newton.effects import EFFECTS, Stage
from tendon_newton.errors import InvalidDeviceCode
from tendon_newton.law import bristles, gear, servo, spool, string
from tendon_newton.simulation.dynamics import sensors
from tendon_newton.simulation.kernels import history_kernels
from tendon_newton.simulation.model.stage_fields import KNOWN_IN, check_stage
from tendon_newton.simulation.tendons import spools, states

CALLERS = (servo, bristles, gear, string, spool, states, sensors, spools, history_kernels)
"""Modules whose functions hand a tendon to the effects of a stage."""
GIVEN = {Stage.STRETCH, Stage.ANGLE, Stage.ENCODER, *KNOWN_IN["error"]}  # Stages of a tendon


@device_template
def misspelt(force: Jet, tendon: Tendon, values: Values) -> Jet:
    """Ask a tendon for what it does not have."""
    return force * tendon.voltag


@device_template
def early(error: Jet, tendon: Tendon, values: Values) -> Jet:
    """Ask for the tension where the error is decided."""
    return error * tendon.tension


def test_a_field_that_no_struct_has_is_refused_in_one_line() -> None:
    """Function, struct, field, those that there are, file and line: no word of Warp's."""
    with pytest.raises(InvalidDeviceCode) as caught:
        Specialiser(Bindings({})).function(misspelt)
    message = str(caught.value)
    assert re.match(r"misspelt asks a Tendon for 'voltag'; it has index, .*, angle_rate ", message)
    assert "\n" not in message
    assert message.endswith(f"test_stages.py:{inspect.getsourcelines(misspelt)[1] + 3})")


def test_a_field_without_value_in_a_stage_is_refused_in_one_line() -> None:
    """A tension is known to the encoder, not to the servo."""
    check_stage(early, Stage.ENCODER)
    with pytest.raises(
        InvalidDeviceCode, match=r"early asks for tendon.tension, .* but in encoder"
    ):
        check_stage(early, Stage.ERROR)


@pytest.mark.parametrize("name", EFFECTS)
def test_no_effect_reads_what_its_stage_does_not_know(name: str) -> None:
    """Also those that no kernel of these tests holds."""
    for stage in Stage:
        hook = EFFECTS[name].hook(stage)
        if hook is not None:
            check_stage(hook, stage)
    for renewal in EFFECTS[name].renewals():
        check_stage(renewal, None)


def functions_of(module: ModuleType) -> Iterator[ast.FunctionDef]:
    """Return the functions of a module."""
    for node in ast.parse(inspect.getsource(module)).body:
        if isinstance(node, ast.FunctionDef):
            yield node


def written_fields(function: ast.FunctionDef, name: str) -> set[str]:
    """Return the fields of a variable that a function writes."""
    return {
        target.attr
        for node in ast.walk(function)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Attribute)
        and isinstance(target.value, ast.Name)
        and target.value.id == name
    }


@pytest.mark.parametrize(
    ("declared", "maker", "name", "late"),
    [(Tendon, "tendon_state", "tendon", set(KNOWN_IN)), (Joint, "joint_state", "joint", set())],
)
def test_all_other_fields_have_their_value_from_the_start(declared, maker, name, late) -> None:
    """The function that describes a tendon, or a joint, writes every field but the late ones."""
    (function,) = (f for f in functions_of(states) if f.name == maker)
    assert written_fields(function, name) == set(declared.__annotations__) - late


def known_at(function: ast.FunctionDef, call: ast.Call, name: str) -> set[str]:
    """Return the late fields of a variable that are known where a function calls another.

    A parameter knows what it knows at every call of the function.
    """
    known: dict[str, set[str]] = {}
    if name in {argument.arg for argument in function.args.args}:
        known[name] = set.intersection(
            *(known_at(*caller) for caller in calls_with(function, name))
        )
    for node in ast.walk(function):
        if not isinstance(node, ast.Assign) or node.lineno >= call.lineno:
            continue
        target = node.targets[0]
        value = node.value
        if isinstance(value, ast.Call) and getattr(value.func, "id", "") == "on_side":
            value = value.args[0]
        if isinstance(target, ast.Name) and isinstance(value, ast.Name):
            copied = value.id
            if target.id == name and copied != name:
                known[name] = known_at(function, call_at(node), copied)
        if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
            known.setdefault(target.value.id, set()).add(target.attr)
    return known.get(name, set()) & set(KNOWN_IN)


def call_at(node: ast.Assign) -> ast.Call:
    """Return a call that stands where an assignment does."""
    return ast.copy_location(ast.Call(func=ast.Name(id=""), args=[], keywords=[]), node)


def calls_with(
    function: ast.FunctionDef, parameter: str
) -> Iterator[tuple[ast.FunctionDef, ast.Call, str]]:
    """Return who calls a function, where, and by which name it knows one of the parameters."""
    place = [argument.arg for argument in function.args.args].index(parameter)
    yield from calls_of(function.name, place)


def calls_of(name: str, place: int) -> Iterator[tuple[ast.FunctionDef, ast.Call, str]]:
    """Return who calls a function of some name, where, and what variable is at an argument."""
    for module in CALLERS:
        for function in functions_of(module):
            for node in ast.walk(function):
                if isinstance(node, ast.Call) and getattr(node.func, "id", "") == name:
                    variable = node.args[place]
                    assert isinstance(variable, ast.Name), ast.unparse(node)
                    yield function, node, variable.id


@pytest.mark.parametrize("stage", sorted(GIVEN, key=lambda s: s.value), ids=lambda s: s.value)
def test_what_a_stage_knows_is_written_before_its_effects_are_called(stage: Stage) -> None:
    """At every place of the device code that calls them, followed from caller to caller."""
    expected = {field for field, stages in KNOWN_IN.items() if stage in stages}
    calls = list(calls_of(f"{stage.value}_effects", 1))
    assert calls
    for function, call, name in calls:
        assert known_at(function, call, name) >= expected, function.name
