"""Files of robots and benches: no name in them leads to another computer or out of their place."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from tendon_newton.cli import main
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
from tendon_newton.mechanisms.authoring.foreign_text import closed_text
from tendon_newton.mechanisms.loading import load_mechanism
from tests.mechanisms.broken.flat_assets import write_changed
from tests.mechanisms.test_asset_command import MJCF, URDF

VISUAL = '<visual><geometry><mesh filename="{}"/></geometry></visual>'


class Server:
    """A server on this computer that counts what is asked of it."""

    def __init__(self) -> None:
        asked: list[str] = []

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                asked.append(self.path)
                self.send_error(404)

            def log_message(self, format: str, *args: object) -> None:
                """Say nothing."""

        self.asked = asked
        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.address = f"http://127.0.0.1:{self.server.server_port}"


@pytest.fixture
def server() -> Iterator[Server]:
    """A server that nobody must ask."""
    one = Server()
    threading.Thread(target=one.server.serve_forever, daemon=True).start()
    yield one
    one.server.shutdown()
    one.server.server_close()
    assert one.asked == []


def urdf_with(name: str) -> str:
    """Return the finger with a mesh on its first link."""
    mesh = VISUAL.format(name)
    return URDF.replace('<link name="middle">', f'<link name="middle">{mesh}')


def mjcf_with(name: str, tag: str = "mesh") -> str:
    """Return the finger with a file of some kind among its assets, and a geom that has its form."""
    asset = f'<asset><{tag} name="m" file="{name}"/></asset>'
    text = MJCF.replace("<worldbody>", f"{asset}<worldbody>")
    geom = '<geom type="mesh" mesh="m"/>' if tag == "mesh" else ""
    return text.replace('<body name="distal"', f'{geom}<body name="distal"')


AWAY = ("{}/big.stl", "file:///etc/passwd", "ftp://a/b.stl", "/etc/passwd", "../../secret.stl")
FORMS = {
    "urdf": urdf_with,
    "urdf texture": lambda name: urdf_with("a.stl").replace(
        "</visual>", f'<material name="m"><texture filename="{name}"/></material></visual>'
    ),
    "mjcf": mjcf_with,
    "mjcf texture": lambda name: mjcf_with(name, "texture"),
    "mjcf field": lambda name: mjcf_with(name, "hfield"),
    "mjcf include": lambda name: MJCF.replace(
        "<worldbody>", f'<include file="{name}"/><worldbody>'
    ),
}


@pytest.mark.parametrize("name", AWAY)
@pytest.mark.parametrize("form", FORMS)
def test_a_robot_that_names_what_lies_elsewhere_is_refused(form, name, server, tmp_path) -> None:
    """Before any library sees it, and nothing is asked of another computer."""
    path = tmp_path / f"arm.{'urdf' if form.startswith('urdf') else 'xml'}"
    path.write_text(FORMS[form](name.format(server.address)))
    with pytest.raises(InvalidAsset, match=r"lies beside it|must lie in the folder|must be there"):
        read_foreign(path)


@pytest.mark.parametrize(
    ("ending", "text"),
    [
        ("urdf", urdf_with("package://arm_description/meshes/middle.stl")),
        ("urdf", urdf_with("../meshes/middle.dae")),
        ("urdf", urdf_with("middle.stl")),
        ("xml", mjcf_with("middle.obj")),
        ("xml", mjcf_with("middle.stl").replace("<compiler", '<compiler meshdir="assets"')),
    ],
)
def test_a_robot_with_meshes_comes_in_without_them(ending, text, tmp_path, capsys) -> None:
    """Joints and inertias are those of the file without any; one line says what was left out."""
    (tmp_path / f"with.{ending}").write_text(text)
    (tmp_path / f"without.{ending}").write_text(URDF if ending == "urdf" else MJCF)
    with_, without = (read_foreign(tmp_path / f"{name}.{ending}") for name in ("with", "without"))
    assert (with_.meshes, without.meshes) == (1, 0)
    for one, other in zip(with_.joints, without.joints, strict=True):
        assert repr(one) == repr(other)
    words = ["asset", "import", str(tmp_path / f"with.{ending}"), "mine", "--folder", str(tmp_path)]
    assert main(words) == 0
    assert "left out, since no mesh is read: 1 shape from files" in capsys.readouterr().out
    assert len(load_mechanism(tmp_path / "mine" / "mine.usda").joints) == 2


def test_a_mass_that_only_a_mesh_tells_is_asked_for(tmp_path: Path) -> None:
    """A link that moves; of the base no mass is needed."""
    link = '<link name="{}"><collision><geometry><mesh filename="a.stl"/></geometry></collision>'
    bare = f"{link.format('distal')}</link>"
    begin, end = URDF.index('<link name="distal">'), URDF.index('<joint name="pip"')
    (tmp_path / "a.urdf").write_text(URDF[:begin] + bare + URDF[end:])
    with pytest.raises(InvalidAsset, match="'distal' has its mass from one: write an <inertial>"):
        read_foreign(tmp_path / "a.urdf")
    (tmp_path / "b.urdf").write_text(
        URDF.replace('<link name="base"/>', f"{link.format('base')}</link>")
    )
    assert read_foreign(tmp_path / "b.urdf").meshes == 1
    geom = '<geom type="mesh" mesh="m"/>'
    body = MJCF.replace('<site name="tip"', f'{geom}<site name="tip"')
    inertial = body.index("<inertial", body.index('name="distal"'))
    (tmp_path / "a.xml").write_text(body[:inertial] + body[body.index("/>", inertial) + 2 :])
    with pytest.raises(InvalidAsset, match="'distal' has its mass from one"):
        read_foreign(tmp_path / "a.xml")


@pytest.mark.parametrize("doubled", [10, 14])
def test_files_that_include_each_other_many_times_are_bounded(doubled: int, tmp_path: Path) -> None:
    """Ten levels of two each would be a thousand files; a file that includes itself has no end."""
    for level in range(doubled):
        twice = 2 * f'<include file="{level + 1}.xml"/>'
        (tmp_path / f"{level}.xml").write_text(f"<mujoco>{twice}</mujoco>")
    (tmp_path / f"{doubled}.xml").write_text("<mujoco/>")
    with pytest.raises(InvalidAsset, match="of at most"):
        closed_text(tmp_path / "0.xml")
    (tmp_path / "5.xml").write_text('<mujoco><include file="3.xml"/></mujoco>')
    with pytest.raises(InvalidAsset, match="must not include itself"):
        closed_text(tmp_path / "0.xml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 nan 0"/>', "<axis xyz> must be numbers"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', "pip: its axis must be a direction"),
        ('<origin xyz="0.03', '<origin xyz="inf', "dip: parent_position must be finite"),
        ('<mass value="0.012"', '<mass value="inf"', "pip: mass must be finite"),
        ('lower="0"', 'lower="nan"', "<limit lower> must be numbers"),
    ],
)
def test_a_joint_whose_numbers_are_none_is_refused(old, new, said, tmp_path) -> None:
    """The joint and what is wrong with it, in place of an error of our own."""
    (tmp_path / "a.urdf").write_text(URDF.replace(old, new, 1))
    with pytest.raises(InvalidAsset, match=said):
        read_foreign(tmp_path / "a.urdf")


SHADER = """
def Material "m" {{
  def Shader "s" {{
    uniform token info:id = "UsdUVTexture"
    {} inputs:file = {}
  }}
}}
"""
NAMING = {
    "reference": 'def Xform "more" (references = @{}@) {{}}',
    "payload": 'def Xform "more" (payload = @@@{}@@@) {{}}',
    "asset": "custom asset more = @{}@",
    "picture": SHADER.format("asset", "@{}@").replace("{\n", "{{\n").replace("}\n", "}}\n"),
    "word": SHADER.format("string", '"{}"').replace("{\n", "{{\n").replace("}\n", "}}\n"),
}
"""Ways in which a layer names a file, or a picture that Newton would open."""
CASES = [
    *((kind, "{}/a.usda", binary) for kind in NAMING for binary in (False, True)),
    *(("reference", name, binary) for name in AWAY[3:] for binary in (False, True)),
    ("picture", "../../../a.png", False),
    ("asset", "`${X}`", False),
]


@pytest.mark.parametrize(("kind", "name", "binary"), CASES)
def test_a_bench_that_names_what_lies_elsewhere_is_refused(
    kind: str, name: str, binary: bool, server: Server, tmp_path: Path, monkeypatch
) -> None:
    """In a text layer or a binary one; nothing is asked of another computer."""
    from pxr import Sdf

    home = tmp_path / "a" / "b" / "c"
    home.mkdir(parents=True)
    monkeypatch.chdir(home)
    path = write_changed(home, "finger")
    text = path.read_text()
    place = text.index("{", text.index('def Xform "finger"')) + 1
    more = NAMING[kind].format(name.format(server.address) if "{}" in name else name)
    path.write_text(f"{text[:place]}\n{more}\n{text[place:]}")
    if binary:
        Sdf.Layer.FindOrOpen(str(path)).Export(str(home / "bench.usdc"))
        path = home / "bench.usdc"
    with pytest.raises(InvalidAsset, match="lies in the folder above its own"):
        load_mechanism(path)
