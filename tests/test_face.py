"""What `import tendon_newton` offers, what it costs, and that its tour runs as it stands."""

import ast
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

import tendon_newton
from tendon_newton.diagnosis.time_left import notebook_progress
from tendon_newton.errors import UnknownName
from tests.diagnosis.made_up import diagnosis

ROOT = Path(__file__).resolve().parents[1]
EXAMPLE = ROOT / "examples" / "hidden_friction"
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


def test_the_tour_runs_as_it_stands(monkeypatch, capsys) -> None:
    """The blocks of docs/python.md in their order; friction halves the error, and slows worlds."""
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    monkeypatch.chdir(ROOT)
    exec(compile("\n".join(blocks), "docs/python.md", "exec"), {})
    said = capsys.readouterr().out
    found = re.search(r"([\d.]+) N without friction, ([\d.]+) N with it", said)
    assert float(found[2]) < 0.5 * float(found[1])
    least, most = re.findall(r"tensor\(\[([\d.]+), ([\d.]+)\]\)", said)[0]
    assert float(most) < float(least)


def test_what_is_printed_is_a_line_and_a_table_without_arrays() -> None:
    """Recording, dataset, model and loop say what they are; words of files are no HTML."""
    dataset = tendon_newton.load_dataset(EXAMPLE)
    model = tendon_newton.load_model(EXAMPLE / "model.toml")
    recording = replace(dataset.test[0], name="<b>.csv")
    finger = tendon_newton.load_mechanism("finger")
    loop = tendon_newton.ControlLoop(finger, model, 3, rate=20.0, device="cpu")
    assert [repr(value) for value in (dataset, recording, model, loop)] == [
        f"Dataset({str(EXAMPLE)!r}: 5 train, 3 test; spring_weak, finger, spring_strong; 119 s)",
        "Recording('<b>.csv', spring_strong: 1105 rows, 13.8 s, command, motor_position, "
        "motor_velocity, force)",
        "Model(ideal(gain=4.2, spool_radius=0.0125))",
        "ControlLoop(mechanism finger, worlds 3, tendons 1, joints 2, rate 20 Hz, device cpu)",
    ]
    pages = [value._repr_html_() for value in (dataset, recording, model, loop)]
    assert all(page.count("<tr>") == page.count("</tr>") > 1 for page in pages)
    assert "&lt;b&gt;.csv" in pages[1]


def test_a_name_that_is_none_is_answered_with_the_nearest() -> None:
    """In every table of the face, as by the functions that look names up."""
    for table, name, near in (
        (tendon_newton.EFFECTS, "coulomb", "coulomb_friction"),
        (tendon_newton.ACTUATORS, "pwm_serv", "pwm_servo"),
        (tendon_newton.FORCE_NETWORKS, "transformers", "transformer"),
    ):
        with pytest.raises(UnknownName, match=f"did you mean '{near}'"):
            table[name]
        assert near in table
        assert table.get(name) is None


def test_plots_are_figures() -> None:
    """With a simulation a residual stands below each signal; a dataset has a panel each."""
    dataset = tendon_newton.load_dataset(EXAMPLE)
    recording = dataset.test[0]
    assert len(recording.plot().axes) == 2
    assert len(recording.plot(recording).axes) == 4
    shown = [axes for axes in dataset.plot().axes if axes.get_visible()]
    assert len(shown) == len(dataset.train) + len(dataset.test)


def test_a_diagnosis_is_a_line_a_table_and_a_figure() -> None:
    """Its causes with numbers no finer than known, and an error without each."""
    found = diagnosis("partly_explained")
    assert repr(found).startswith("Diagnosis(partly_explained: viscous_friction coefficient 0.81")
    assert "command_delay delay 22.9" in repr(found)
    assert "held-out angle error 300 to 0.500 mrad RMS" in repr(found)
    assert found._repr_html_().count("<tr>") == 3
    angle, force = found.plot().axes
    assert [len(axes.patches) for axes in (angle, force)] == [4, 4]


def test_a_notebook_shows_what_is_being_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, written anew; a terminal of IPython and plain Python show nothing."""
    shown: list[str] = []
    line = SimpleNamespace(update=shown.append)
    display = SimpleNamespace(display=lambda _, display_id: line)
    shell = SimpleNamespace(kernel=None)
    ipython = SimpleNamespace(get_ipython=lambda: shell, display=display)
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    notebook_progress()("looking at 42 effects")
    assert shown == ["0 s  looking at 42 effects"]
    del shell.kernel
    notebook_progress()("looking at 42 effects")
    assert len(shown) == 1
