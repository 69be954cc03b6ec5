"""Whatever stands in the lines of an asset, checking and loading it give findings or our errors."""

import re
from collections.abc import Callable

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.loading import load_mechanism
from tests.mechanisms.broken.flat_assets import flat_text

VALUES = (
    "0",
    "-1",
    "1e30",
    "1e-30",
    "nan",
    "inf",
    "-inf",
    '"word"',
    "(1, 2)",
    "(0, 0, 0)",
    "[]",
    "[0.01]",
    "[1e30, -1e30]",
    "(0, 0, 0, 0)",
    "true",
    "</finger>",
    "</finger/no>",
    "None",
)
TYPES = ("double", "float", "int", "string", "token", "bool", "double[]", "float3", "rel", "asset")
SCHEMAS = (
    "Xform",
    "Scope",
    "PhysicsRevoluteJoint",
    "PhysicsPrismaticJoint",
    "PhysicsFixedJoint",
    "PhysicsDistanceJoint",
    "PhysicsJoint",
    "MjcTendon",
    "PhysicsScene",
    "Capsule",
    "Mesh",
)

Change = Callable[[list[str]], list[str]]


@st.composite
def line_changes(draw: st.DrawFn) -> Change:
    """A change of one line: its value, its type, its prim's schema, or all of it."""
    kind = draw(st.sampled_from(("value", "value", "type", "schema", "drop", "double", "swap")))
    place, other = draw(st.integers(0, 10_000)), draw(st.integers(0, 10_000))
    value = draw(st.sampled_from(VALUES))
    type_name, schema = draw(st.sampled_from(TYPES)), draw(st.sampled_from(SCHEMAS))

    def change(lines: list[str]) -> list[str]:
        pattern = r"^ *def \w+" if kind == "schema" else r"^ +[\w ]*(\[\])? ?[\w:]+ = "
        fitting = [n for n, line in enumerate(lines) if re.match(pattern, line)]
        if not fitting:
            return lines
        at = fitting[place % len(fitting)]
        lines = list(lines)
        if kind == "value":
            lines[at] = f"{lines[at].split(' = ')[0]} = {value}"
        elif kind == "type":
            name = lines[at].split(" = ")[0].split()[-1]
            lines[at] = f"{type_name} {name} = {value}"
        elif kind == "schema":
            lines[at] = re.sub(r"def \w+", f"def {schema}", lines[at])
        elif kind == "drop":
            del lines[at]
        elif kind == "double":
            lines.insert(at, lines[at])
        else:
            far = fitting[other % len(fitting)]
            lines[at], lines[far] = lines[far], lines[at]
        return lines

    return change


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=st.lists(line_changes(), min_size=1, max_size=4))
def test_a_spoiled_asset_is_checked_and_read_or_refused(tmp_path, changes) -> None:
    """A finding or an InvalidAsset, and nothing else; what has no error loads."""
    lines = flat_text("finger").split("\n")
    for change in changes:
        lines = change(lines)
    path = tmp_path / "spoiled.usda"
    path.write_text("\n".join(lines))
    try:
        findings = check_asset(path)
    except InvalidAsset:
        return
    if not any(finding.severity == "error" for finding in findings):
        load_mechanism(path)
