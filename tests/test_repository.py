"""What the repository says of itself is so."""

import ast
import re
import subprocess
import tomllib
from collections import Counter
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tendon_newton.cli import every_verb
from tests.prose import sentences, word_count

ROOT = Path(__file__).resolve().parents[1]
TEXT = (
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "AGENTS.md",
    "SECURITY.md",
    "llms.txt",
    *sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md")),
)
UNREAD = ("CHANGELOG.md",)  # A text of notes
LONGEST = 30  # Words of the longest sentence
BARE = re.compile(r"\W*(?:It|They|He|She|(?:This|That|These|Those) (?:is|are|was|were))\b")
"""How a sentence begins whose subject stands in the one before."""
MACHINE_PATH = re.compile(r"(?<![\w.~/:-])/(?:home|root|Users|work|mnt|opt|tmp)/[\w.-]+")

every_text = pytest.mark.parametrize("name", TEXT)


def read(name: str) -> str:
    """Return a text of the repository."""
    return (ROOT / name).read_text(encoding="utf-8")


def repository_files() -> list[Path]:
    """Return the files that are, or would be, under version control."""
    listing = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    if listing.returncode:
        pytest.skip("not a git checkout", allow_module_level=True)
    return [ROOT / name for name in listing.stdout.split("\0") if name and (ROOT / name).is_file()]


@every_text
def test_every_make_command_in_the_text_is_a_target(name: str) -> None:
    """``make x`` in a text is a target of the Makefile."""
    targets = set(re.findall(r"^([a-z]+):", read("Makefile"), re.MULTILINE))
    assert set(re.findall(r"(?:^|`)make ([a-z]+)", read(name), re.MULTILINE)) <= targets


@every_text
def test_every_verb_in_the_text_exists(name: str) -> None:
    """``tendon-newton x`` in a text is a verb of the command line."""
    verbs = set(re.findall(r"(?:^|`)tendon-newton ([a-z]+(?:-[a-z]+)*)", read(name), re.MULTILINE))
    assert verbs <= set(every_verb())


@every_text
def test_every_link_in_the_text_leads_to_a_file(name: str) -> None:
    """A link that is no address and no picture names a file of the repository."""
    links = re.findall(r"(?<!!)\[[^\]]*\]\(([^)\s]+)\)", read(name))
    places = [link.partition("#") for link in links if "://" not in link]
    here = ROOT / name
    targets = [(here.parent / file if file else here, section) for file, _, section in places]
    assert [str(file) for file, _ in targets if not file.exists()] == []
    assert [f"{file}#{part}" for file, part in targets if part and part not in anchors(file)] == []


def anchors(path: Path) -> set[str]:
    """Return the anchors of a text's headings, as a reader of Markdown makes them."""
    headings = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@every_text
def test_every_source_file_in_the_text_exists(name: str) -> None:
    """A Python file in a text is the end of some path of the repository."""
    wanted = re.findall(r"`([\w./]+\.py)`", read(name))
    paths = [f"/{path.relative_to(ROOT).as_posix()}" for path in repository_files()]
    assert [file for file in wanted if not any(path.endswith(f"/{file}") for path in paths)] == []


@every_text
def test_every_sentence_of_the_text_is_short_and_has_its_subject(name: str) -> None:
    """No sentence has more than 30 words, or begins with a pronoun for its subject."""
    if name in UNREAD:
        return
    found = [s for s in sentences(read(name)) if word_count(s) > LONGEST or BARE.match(s)]
    assert found == []


def test_the_index_lists_every_page() -> None:
    """Each page of the documentation is linked from its index."""
    linked = set(re.findall(r"\]\(([\w/.]+\.md)", read("docs/index.md")))
    pages = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert pages - linked == {"index.md"}


def test_an_image_is_given_what_a_wheel_is_made_of() -> None:
    """``.dockerignore`` lets in the wheel's folders and what an installation reads beside them."""
    wheel = tomllib.loads(read("pyproject.toml"))["tool"]["hatch"]["build"]["targets"]["wheel"]
    hashes = ["requirements-hashes.txt", "requirements-hashes-sim.txt"]
    pins = ["constraints.txt", *hashes, ".github/requirements-build.txt"]
    beside = ["pyproject.toml", *pins, "README.md", "LICENSE"]
    assert re.findall(r"^!(.+)$", read(".dockerignore"), re.M) == beside + wheel["only-include"]


def test_what_builds_and_publishes_is_named_by_its_content() -> None:
    """Actions by commit, bases of images by digest, tools of a release by hash; rights are few."""
    for name in ("check", "release"):
        workflow = read(f".github/workflows/{name}.yml")
        assert re.findall(r"uses: (?!\S+@[0-9a-f]{40} # v)(.*)", workflow) == []
        assert "\npermissions:\n  contents: read\njobs:\n" in workflow
        assert re.findall(r"pipx? (?!install --no-deps --require-hashes)", workflow) == []
    for name in ("pi", "training"):
        image = read(f"docker/{name}.Dockerfile")
        assert re.findall(r"^FROM (.+)$", image, re.M) == ["${BASE} AS wheel", "${BASE}"]
        installs = re.findall(r"pip install --no-cache-dir (.+)", image)
        unhashed = [
            each for each in installs if not re.search(r"--(require-hashes|no-index) ", each)
        ]
        assert all("grep '^torch==' constraints.txt" in each for each in unhashed)
        assert re.search(r"^ARG BASE=\S+@sha256:[0-9a-f]{64}$", image, re.M)
    tools = re.findall(r"^(\S+)==\S+ \\\n    --hash=", read(".github/requirements-build.txt"), re.M)
    assert {"build", "hatchling"} <= set(tools)


def test_the_page_on_architecture_has_every_layer() -> None:
    """Its table lists the layers that import-linter checks, in their order."""
    contracts = tomllib.loads(read("pyproject.toml"))["tool"]["importlinter"]["contracts"]
    layers = next(c["layers"] for c in contracts if c["name"] == "imports point down")
    section = read("docs/architecture.md").partition("## The layers")[2]
    rows = [re.findall(r"`([\w.]+)`", row) for row in re.findall(r"^\| (`.+?) \|", section, re.M)]
    assert rows[: len(layers)] == [layer.split(" | ") for layer in layers]


def test_no_file_names_a_path_of_one_machine() -> None:
    """What is in the repository works in any folder of any computer."""
    found = []
    for path in repository_files():
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue  # a picture or an archive
        found += [f"{path.relative_to(ROOT)}: {match}" for match in MACHINE_PATH.findall(text)]
    assert found == []


def test_every_direct_dependency_is_pinned() -> None:
    """``constraints.txt`` has an exact version of all that ``pyproject.toml`` asks for."""
    project = tomllib.loads(read("pyproject.toml"))["project"]
    lists = [project["dependencies"], *project["optional-dependencies"].values()]
    wanted = {canonicalize_name(Requirement(line).name) for lines in lists for line in lines}
    pins = [line for line in read("constraints.txt").splitlines() if not line.startswith("#")]
    assert [line for line in pins if not re.fullmatch(r"[\w.-]+==[\w.]+", line)] == []
    pinned = {canonicalize_name(Requirement(line).name) for line in pins}
    assert wanted - pinned == {"tendon-newton"}


def test_every_version_that_is_pinned_has_its_hashes() -> None:
    """The files of hashes have the versions of `constraints.txt`, all but torch's."""
    pinned = set(re.findall(r"^(\S+==\S+)$", read("constraints.txt"), re.MULTILINE))
    hashes = read("requirements-hashes.txt") + read("requirements-hashes-sim.txt")
    hashed = re.findall(r"^(\S+==\S+) \\\n    --hash=sha256:", hashes, re.M)
    torch = {line for line in pinned if line.startswith("torch==")}
    assert {canonicalize_name(line) for line in hashed} == {
        canonicalize_name(line) for line in pinned - torch
    }


def test_the_demo_installs_nothing_but_what_it_needs(tmp_path: Path) -> None:
    """``make demo`` takes the extra `sim` with its hashes; the rest comes with ``make setup``."""
    for name in ("Makefile", "pyproject.toml", "constraints.txt", "requirements-hashes-sim.txt"):
        (tmp_path / name).write_text(read(name), encoding="utf-8")
    run = subprocess.run(
        ["make", "--dry-run", "demo"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert re.findall(r"-r (\S+)|-e (\S+)", run.stdout) == [
        ("requirements-hashes-sim.txt", ""),
        ("", '".[sim]"'),
    ]


TABLES = {"tendon_newton/effects", "lab/studies"}
"""Folders with one file for each entry of a table."""
MOST_FILES = 15  # Modules that a reader can hold in the head


def test_no_folder_is_crowded() -> None:
    """A folder shows the architecture only while its names can be read at a glance."""
    counts = Counter(
        path.parent.relative_to(ROOT).as_posix()
        for path in repository_files()
        if path.suffix == ".py" and path.name != "__init__.py"
    )
    assert {name for name, count in counts.items() if count > MOST_FILES} - TABLES == set()


PROGRAM = re.compile(r'^if __name__ == "__main__":', re.MULTILINE)
READS = re.compile(r"ArgumentParser\(|tyro\.cli\(")
MAIN_OF = re.compile(r"^from ([\w.]+) import main$", re.MULTILINE)


def test_every_program_of_the_lab_reads_its_words_before_it_works() -> None:
    """`--help` prints help, and measures nothing."""
    files = [f for f in (ROOT / "lab").rglob("*.py") if {"studies", "tests"}.isdisjoint(f.parts)]
    programs = [(f, f.read_text("utf-8")) for f in files]
    deaf = []
    for file, text in programs:
        told = MAIN_OF.search(text)
        main = ROOT / f"{told[1].replace('.', '/')}.py" if told else file
        if PROGRAM.search(text) and not READS.search(main.read_text("utf-8")):
            deaf.append(file.relative_to(ROOT).as_posix())
    assert deaf == []


DELETIONS = {
    "hardware/tendon_hardware/load_cells/calibration_session.py": "points that the file now holds",
    "hardware/tendon_hardware/virtual_bench/process.py": "its own temporary folder",
    "hardware/tendon_hardware/virtual_bench/server.py": "links in that folder",
    "tendon_newton/data/files/together.py": "drafts of files that are being written",
}
"""Files that delete something, and what: nothing that the same run has not written."""


def test_only_what_a_run_has_written_is_deleted() -> None:
    """A folder for results may be the user's home; a new deletion must be thought about here."""
    deletes = re.compile(r"rmtree|\.unlink\(|\.rmdir\(|os\.(?:remove|rmdir)|shutil\.move")
    folders = ("tendon_newton", "train", "hardware", "lab")
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.py")
             if "tests" not in file.parts]  # fmt: skip
    found = {f.relative_to(ROOT).as_posix() for f in files if deletes.search(f.read_text("utf-8"))}
    assert found == set(DELETIONS)


def unquoted(text: ast.JoinedStr) -> list[str]:
    """Return what a proposed command of the program takes in without quotes for a shell."""
    shown = [v.value if isinstance(v, ast.Constant) else v for v in text.values]
    places = [k for k, v in enumerate(shown) if isinstance(v, str) and COMMAND.search(v)]
    values = [ast.unparse(v.value) for v in text.values[min(places, default=len(shown)) :]
              if isinstance(v, ast.FormattedValue)]  # fmt: skip
    return [v for v in values if "shlex." not in v and not v.isupper() and v not in QUOTED]


COMMAND = re.compile(rf"(?:tendon-newton (?:{'|'.join(every_verb())})|chmod \d+|sudo rm|mjcf=)")
QUOTED = {"verb", "named", "config.port"}  # What is safe, was quoted before, or is no command


def test_paths_in_proposed_commands_are_quoted() -> None:
    """A command can be copied into a shell whatever a folder is called."""
    folders = ("tendon_newton", "train", "hardware", "lab/tendon_lab")
    found = [
        f"{file.relative_to(ROOT)}:{node.lineno}: {value}"
        for folder in folders
        for file in (ROOT / folder).rglob("*.py")
        if COMMAND.search(text := file.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.JoinedStr)
        for value in unquoted(node)
    ]
    assert found == []
