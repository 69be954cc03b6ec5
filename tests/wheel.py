"""Build wheel and sdist, install them into a clean environment, and run the demo from there.

``python -m tests.wheel`` takes minutes and an index of packages; `make nightly` runs it. The wheel
comes from the sdist, so that both have all that they need. First the kernels of the README's
diagnoses and of a training are compiled anew; they go into ``tendon_newton/_kernels``, which every
later build takes.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import warp as wp

from tendon_newton.device_code.kernel_loading import TIMES
from tests.interpreters import search_path

ROOT = Path(__file__).resolve().parents[1]
KERNELS = ROOT / "tendon_newton" / "_kernels"
COMPILING = (
    "demo --out {out}/demo",
    "collect --plan quick --port virtual --faster-than-real-time --out {out}/recordings",
    "diagnose {out}/recordings --budget 10s --out {out}/diagnosis",
    "train-policy --worlds 32 --steps 8 --iterations 1 --out {out}/policy",
)
"""What compiles the kernels that a wheel brings: of the bundled recordings, of a bench with
Dynamixel servos, and of the worlds of a training."""
BROUGHT = ("rollout", "settle", "control_step", "read", "forget", "adopt", "guard")
"""Kinds of kernels whose objects serve every processor."""


def main() -> None:
    """Build, install, run; leave with the code of what failed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compile_kernels(folder / "compiled")
        wheel = build(folder)
        python = clean_environment(folder / "clean")
        user = folder / "user"
        user.mkdir()
        for script in ("train.py", "hardware.py"):  # a user's own, which shadow nothing
            (user / script).write_text("raise SystemExit('shadowed')\n", encoding="utf-8")
        for extra, check in (("sim", check_demo), ("train", check_training)):
            pip(python, "-c", str(ROOT / "constraints.txt"), f"{wheel}[{extra}]")
            check([python, "-m", "tendon_newton"], user)
            told = user / "kernels" / wp.__version__ / TIMES
            assert not told.exists(), f"it compiled: {told.read_text(encoding='utf-8')}"
    print("the wheel, made from the sdist, runs the demo and trains in a clean environment")


def compile_kernels(cache: Path) -> None:
    """Keep those kernels that serve every processor, without source."""
    shutil.rmtree(KERNELS, ignore_errors=True)
    for line in COMPILING:
        words = [sys.executable, "-m", "tendon_newton", *line.format(out=cache / "out").split()]
        run(words, cwd=ROOT, PYTHONPATH=search_path(ROOT), WARP_CACHE_PATH=str(cache))
    for kind in BROUGHT:
        for kernel in cache.glob(f"*/wp_{kind}_kernel_*"):
            shutil.copytree(kernel, KERNELS / kernel.name, ignore=shutil.ignore_patterns("*.cpp"))


def build(folder: Path) -> Path:
    """Make the sdist of the clone, and a wheel of the sdist."""
    python = clean_environment(folder / "builder")
    pip(python, "build")
    run([python, "-m", "build", "--outdir", str(folder), str(ROOT)])
    (wheel,) = folder.glob("*.whl")
    (sdist,) = folder.glob("*.tar.gz")
    print(f"{wheel.name} {wheel.stat().st_size:,} bytes, {sdist.name} {sdist.stat().st_size:,}")
    return wheel


def check_demo(program: list[str], folder: Path) -> None:
    """Run the demo in a folder that is no clone, and look at its answer."""
    run([*program, "demo", "--out", "demo"], cwd=folder, WARP_CACHE_PATH=str(folder / "kernels"))
    stated = json.loads((folder / "demo" / "diagnosis.json").read_text(encoding="utf-8"))
    assert [effect["name"] for effect in stated["effects"]] == ["viscous_friction"], stated
    assert (folder / "demo" / "report.html").stat().st_size > 0
    for words in (["--help"], ["asset", "check", "finger"]):
        run([*program, *words], cwd=folder)


def check_training(program: list[str], folder: Path) -> None:
    """Train for one iteration there."""
    run([*program, "train-policy", "--help"], cwd=folder)
    words = ["train-policy", "--worlds", "32", "--steps", "8", "--iterations", "1", "--out", "own"]
    run([*program, *words], cwd=folder, WARP_CACHE_PATH=str(folder / "kernels"))
    assert (folder / "own" / "policy.onnx").stat().st_size > 0


def clean_environment(folder: Path) -> str:
    """Make an empty environment and return its interpreter."""
    venv.create(folder, with_pip=True)
    return str(folder / "bin" / "python")


def pip(python: str, *words: str) -> None:
    """Install into an environment."""
    run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *words])


def run(words: list[str], cwd: Path | None = None, **environment: str) -> None:
    """Run a program; no package of ours is found but the installed one."""
    known = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | environment
    result = subprocess.run(words, cwd=cwd, env=known)
    if result.returncode:
        sys.exit(f"{' '.join(words)}: exit code {result.returncode}")


if __name__ == "__main__":
    main()
