"""Whether the GPU's figures are of today's programs: what they time, as fingerprints.

Run from the root of the repository; no GPU is needed::

    python -m lab.benchmarks.programs            # compare with what was measured
    python -m lab.benchmarks.programs --write    # after a measurement

Our engines take a control step on the CPU, and every kernel that runs in it is compiled for the
device of the figures. The kernels' instructions (PTX) without names are hashed, and stand in
``gpu.json``. A commit that changes none of them changes no figure of ``mechanics`` and ``loop``.
"""

import argparse
import gc
import hashlib
import json
import re
import sys
import tempfile
from pathlib import Path

import warp as wp

from lab.benchmarks.engines_timed.engines import JOINT_FRICTION, TendonEngine
from lab.benchmarks.engines_timed.network_engines import LoopEngine
from lab.benchmarks.engines_timed.soundness import CONTROL_STEP
from lab.benchmarks.gpu import RESULT
from lab.benchmarks.network import authors_network, fused
from tendon_newton.device_code.quiet import quiet_warp

ARCHITECTURE = 90  # CUDA architecture of the H200
SUBSTEPS = 4
"""Substeps of a control step; their number is an argument of a kernel and no part of it."""
BEGINNINGS = {"adopt_kernel", "forget_kernel", "settle_kernel"}
"""Kernels that run only where worlds begin, before the clock starts."""
HASHES = re.compile(r"_[0-9a-f]{7,12}(?=[_\W])|_cu_[0-9a-f]{8}\d*")
"""What changes in a name when anything changes."""


def run_engines() -> None:
    """Take a control step with each of our engines, which loads their kernels."""
    query = fused(authors_network())
    with wp.ScopedDevice("cpu"):
        for engine in (
            TendonEngine(64, CONTROL_STEP / SUBSTEPS, friction=JOINT_FRICTION),
            LoopEngine(64, CONTROL_STEP / SUBSTEPS, query=query),
        ):
            engine.begin()
            engine.run()


def nameless(text: str) -> str:
    """Return a program's text without hashes in its names."""
    while (shorter := HASHES.sub("", text)) != text:
        text = shorter
    return text


def plain_name(module: wp.Module) -> str:
    """Return a module's name without hashes."""
    return nameless(f"{module.name}_").strip("_")


def own_modules() -> list[wp.Module]:
    """Return the modules that were loaded and are ours: what builds a model is Newton's."""
    loaded = [m for m in gc.get_objects() if type(m) is wp.Module and m.execs]
    writers = [next(iter(m.kernels.values())).func.__module__ for m in loaded]
    pairs = zip(loaded, writers, strict=True)
    return [module for module, writer in pairs if not writer.startswith("newton.")]


def instructions(module: wp.Module, folder: Path) -> str:
    """Return the fingerprint of a module, compiled for the device of the figures."""
    made = wp.compile_aot_module(module, arch=ARCHITECTURE, module_dir=folder, use_ptx=True)
    lines = (line for line in made[0].read_text().splitlines() if not line.startswith("//"))
    return hashlib.sha256(nameless("\n".join(lines)).encode()).hexdigest()[:16]


def fingerprints() -> dict[str, str]:
    """Return the fingerprint of every program that is timed, by its name."""
    run_engines()
    found: dict[str, list[str]] = {}
    for module in own_modules():
        if plain_name(module) in BEGINNINGS:
            continue
        with tempfile.TemporaryDirectory() as folder:
            fingerprint = instructions(module, Path(folder))
        found.setdefault(plain_name(module), []).append(fingerprint)
    return {name: " ".join(sorted(found[name])) for name in sorted(found)}


def main() -> int:
    """Compare or write; return how many programs differ from those that were timed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="these are what was measured")
    write = parser.parse_args().write
    quiet_warp()
    measured, today = json.loads(RESULT.read_text()), fingerprints()
    before = today if write else measured.get("programs", {})
    for name in sorted(today.keys() | before.keys()):
        state = "as measured" if today.get(name) == before.get(name) else "CHANGED"
        sys.stdout.write(f"{state:12} {today.get(name, '-'):40} {name}\n")
    if write:
        RESULT.write_text(json.dumps({**measured, "programs": today}, indent=1) + "\n")
    return sum(today.get(name) != before.get(name) for name in today.keys() | before.keys())


if __name__ == "__main__":
    sys.exit(main())
