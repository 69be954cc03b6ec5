"""What `import tendon_newton` offers, what it costs, and that its tour runs as it stands."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import tendon_newton

ROOT = Path(__file__).resolve().parents[1]
HEAVY = ("warp", "newton", "mujoco", "torch", "pxr", "matplotlib", "scipy", "numpy")


def test_the_package_itself_loads_nothing() -> None:
    """Neither the simulator nor numpy; a name that reads files brings no simulator either."""
    code = (
        "import sys, tendon_newton; first = set(sys.modules); tendon_newton.load_dataset; "
        "dir(tendon_newton); second = set(sys.modules); "
        f"heavy = set({HEAVY}); print(sorted(heavy & first), sorted(heavy & second))"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[] ['numpy']"


@pytest.mark.parametrize("name", tendon_newton.EXPORTS)
def test_every_name_is_there_with_words(name: str) -> None:
    """Each name leads to what its module has, and says what it is."""
    value = getattr(tendon_newton, name)
    assert value is getattr(sys.modules[tendon_newton.EXPORTS[name]], name)
    assert isinstance(value, dict) or value.__doc__
    assert name in dir(tendon_newton)


def test_type_checkers_see_the_same_names() -> None:
    """The stub beside the package imports each name from the module of the table."""
    stub = ast.parse((ROOT / "tendon_newton" / "__init__.pyi").read_text(encoding="utf-8"))
    seen = {
        alias.asname: node.module
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert seen == tendon_newton.EXPORTS


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    """As of every module."""
    name = "load_datasets"
    with pytest.raises(AttributeError, match="'tendon_newton' has no attribute 'load_datasets'"):
        getattr(tendon_newton, name)


def test_the_tour_runs_as_it_stands(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The blocks of docs/python.md in their order; friction halves the error, and slows worlds."""
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    monkeypatch.chdir(ROOT)
    exec(compile("\n".join(blocks), "docs/python.md", "exec"), {})
    said = capsys.readouterr().out
    found = re.search(r"([\d.]+) N without friction, ([\d.]+) N with it", said)
    assert found is not None
    assert float(found[2]) < 0.5 * float(found[1])
    least, most = re.findall(r"tensor\(\[([\d.]+), ([\d.]+)\]\)", said)[0]
    assert float(most) < float(least)
