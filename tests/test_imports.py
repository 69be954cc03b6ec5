"""What each part of the program loads, and where every module stands in the layers."""

import ast
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.interpreters import python

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {
    "tendon_newton": "tendon_newton",
    "tendon_train": "train/tendon_train",
    "tendon_hardware": "hardware/tendon_hardware",
    "tendon_lab": "lab/tendon_lab",
}
"""Where each package stands in a clone."""


def test_a_training_loads_no_package_of_statistics() -> None:
    """scipy.stats takes 0.6 s at each start; scipy.special has the quantiles."""
    loaded = "sys.modules.get('scipy.stats') and sys.exit('scipy.stats')"
    code = f"import sys, tendon_newton.diagnosis.search.decide.find_causes; {loaded}"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def layers_of_packages() -> dict[str, set[str]]:
    """Return the names in the layers of the whole and of each package."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers: dict[str, set[str]] = {}
    for contract in settings["tool"]["importlinter"]["contracts"]:
        if contract["type"] == "layers":
            (package,) = contract.get("containers", ["tendon_newton"])
            names = [name.strip(" ()") for row in contract["layers"] for name in row.split("|")]
            layers[package] = {name.removeprefix("tendon_newton.") for name in names}
    return layers


@pytest.mark.parametrize("package", layers_of_packages())
def test_every_module_has_a_place_in_the_layers(package: str) -> None:
    """A module that no layer names would escape the rule."""
    top, *inner = package.split(".")
    folder = ROOT.joinpath(PACKAGES[top], *inner)
    modules = {
        path.stem
        for path in folder.iterdir()
        if path.suffix == ".py" or (path / "__init__.py").is_file()
    }
    assert modules - {"__init__", "__main__"} - layers_of_packages()[package] == set()


MOST_SHARED = 10  # Names that may stand for several things, in all
OWN_NAMES = {"__init__", "__main__"}


def test_a_name_stands_for_one_thing() -> None:
    """Few modules and classes share a name, and none of one room: a search finds what is meant."""
    places: dict[str, list[tuple[str, ...]]] = {}
    for folder in PACKAGES.values():
        for path in (ROOT / folder).rglob("*.py"):
            room = path.relative_to(ROOT).parts[:2]
            tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            classes = [node.name for node in tree if isinstance(node, ast.ClassDef)]
            for name in {path.stem, *classes} - OWN_NAMES:
                places.setdefault(name, []).append(room)
    shared = {name: rooms for name, rooms in places.items() if len(rooms) > 1}
    assert [name for name, rooms in shared.items() if len(set(rooms)) < len(rooms)] == []
    assert len([name for name in shared if name[0].isupper()]) <= MOST_SHARED
    assert len([name for name in shared if name[0].islower()]) <= MOST_SHARED


def test_every_imported_package_is_declared() -> None:
    """What the packages import stands in ``pyproject.toml`` and does not come along by luck."""
    declared = {
        canonicalize_name(Requirement(line).name) for line in requires("tendon-newton") or ()
    }
    distributions = packages_distributions()
    imported = set().union(
        *(
            top_level_imports(path.read_text(encoding="utf-8"))
            for folder in PACKAGES.values()
            for path in (ROOT / folder).rglob("*.py")
        )
    )
    undeclared = {
        name
        for name in imported - set(sys.stdlib_module_names) - set(PACKAGES)
        if not declared & {canonicalize_name(d) for d in distributions.get(name, [name])}
    }
    assert not undeclared


def top_level_imports(text: str) -> set[str]:
    """Return the first part of every name that a program imports."""
    names = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("verb", ["train-policy", "deploy", "collect"])
def test_a_script_of_the_current_folder_shadows_nothing(verb: str, tmp_path: Path) -> None:
    """`python -m` puts the folder of the user first; a train.py there is never imported."""
    for name in ("train", "hardware", "random", "tyro"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('shadowed')\n")
    said = python("-m", "tendon_newton", verb, "--help", cwd=tmp_path)
    assert said.returncode == 0, said.stderr
    assert "usage" in said.stdout
