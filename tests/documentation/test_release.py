"""One step writes a version into all files that state one."""

import re
import tomllib

import pytest

from docs.release import CHANGES, STATED, UNRELEASED, read, released, stated

DAY = "2030-01-02"


def changed() -> dict[str, str]:
    """Return the files of a tree in which something has changed since its last version."""
    texts = read()
    list_of_changes = texts[CHANGES].replace(UNRELEASED, f"{UNRELEASED}\n- A change.\n", 1)
    return {**texts, CHANGES: list_of_changes}


def test_all_files_state_the_same_version() -> None:
    """Also the recipe for conda, and what is cited."""
    texts = read()
    for name, pattern in STATED.items():
        (line,) = (m.group() for m in re.finditer(pattern, texts[name], flags=re.MULTILINE))
        assert line.split()[-1].strip('"') == stated(texts), name


def test_a_release_is_one_step() -> None:
    """Each file says it once; what was unreleased stands under the version, with its day."""
    before, after = changed(), released(changed(), "99.0.0", DAY)
    assert all(after[name].count("99.0.0") == 1 for name in STATED)
    assert f"{UNRELEASED}\n## [99.0.0] - {DAY}\n\n- A change.\n" in after[CHANGES]
    assert len(after[CHANGES]) - len(before[CHANGES]) == len(f"\n## [99.0.0] - {DAY}\n")
    assert after["CITATION.cff"].endswith(f"date-released: {DAY}\n")
    again = released({**after, CHANGES: before[CHANGES]}, "99.0.1", "2030-02-03")
    assert again["CITATION.cff"].count("date-released") == 1


@pytest.mark.parametrize("version", ["0.0.9", "0.1", "v1.0.0", "1.0.0rc1"])
def test_what_is_no_later_version_is_refused(version: str) -> None:
    """The message names the version that stands."""
    with pytest.raises(SystemExit, match=f"later than .*, not {version}"):
        released(changed(), version, DAY)


def test_without_a_change_nothing_is_released() -> None:
    """A version whose list is empty."""
    with pytest.raises(SystemExit, match="nothing stands under Unreleased"):
        released(released(changed(), "99.0.0", DAY), "99.0.1", DAY)


def test_the_recipe_for_conda_needs_what_the_package_needs() -> None:
    """Its names and versions, and the same command."""
    texts = read()
    project = tomllib.loads(texts["pyproject.toml"])["project"]
    recipe = texts["conda/recipe.yaml"]
    run = recipe.split("  run:\n")[1].split("tests:")[0]
    needs = {line.strip(" -").replace(" ", "") for line in run.splitlines()}
    assert needs == {*project["dependencies"], f"python{project['requires-python']}"}
    ((name, function),) = project["scripts"].items()
    assert f"- {name} = {function}\n" in recipe
