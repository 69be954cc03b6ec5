"""Other interpreters: where they find the packages of a clone, and one as on a Raspberry Pi."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
ABSENT = ("warp", "newton", "torch", "pxr", "mujoco", "scipy", "matplotlib", "rosbags", "jinja2")
"""Packages outside the extra ``hardware``."""
BLOCK = f"""
import sys
from importlib.abc import MetaPathFinder
class Absent(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {ABSENT}:
            asked.append(name)
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
asked = []
sys.meta_path.insert(0, Absent())
"""


def search_path(clone: Path) -> str:
    """Return the PYTHONPATH of a clone: three of its packages stand in folders of their own."""
    return os.pathsep.join(str(clone / part) for part in ("", "train", "hardware", "lab"))


def python(
    *words: object, cwd: Path = ROOT, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run an interpreter of its own, which finds this clone wherever it works, to its end."""
    return subprocess.run(
        [sys.executable, *map(str, words)],
        cwd=cwd,
        env=os.environ | {"PYTHONPATH": search_path(ROOT)} | environment,
        capture_output=True,
        text=True,
        timeout=600,
    )


def run_without(code: str) -> str:
    """Run code where those packages are absent; return what it printed, if it asked for none."""
    result = python("-c", f"{BLOCK}{code}\nassert not asked, asked")
    assert result.returncode == 0, result.stderr
    return result.stdout
