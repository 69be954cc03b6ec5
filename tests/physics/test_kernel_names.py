"""A kernel is compiled once, whatever was compiled before it: the next process finds its binary."""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

from tests.interpreters import python

ROOT = Path(__file__).resolve().parents[2]
PRELUDE = """
import warp as wp

from tendon_newton.data.model_file import load_model
from tendon_newton.simulation.hosts.replay import rollout_of
from tendon_newton.simulation.hosts.rollout import Candidates
from tendon_newton.mechanisms.loading import load_mechanism
from tests.physics.runs import run_of

model = load_model("examples/hidden_friction/model.toml")
run = run_of([[0.0], [0.5]], bench="spring_weak")  # one joint, compiled soonest
own = Candidates(effects=["coulomb_friction"])
rollout = rollout_of(load_mechanism(run.bench), [run], model, candidates=own)
"""
REPLAY = "rollout.run(rollout.base_vectors(model)[None])"
NAMES = """
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.dynamics.settling import settle_kernel
from tendon_newton.simulation.model.assembly import assemble
from tendon_newton.simulation.model.chain_copies import copies_of
from tendon_newton.simulation.model.structure import Structure

for asset in ("finger", "hand_ball"):
    model = build_model(load_mechanism(asset), 1, device="cpu")
    topology = vars(copies_of(model).topology)
    structure = Structure(**topology, actuator="ideal", effects=(), planar=False)
    print("name", assemble(structure).kernel(settle_kernel).key)
"""
OTHER_WAY_ROUND = "wp.load_module(rollout.kernels.rollout.module)\n" + REPLAY


def compiled(cache: Path, program: str) -> list[str]:
    """Run a program with a kernel cache of its own; return what is in it: names without hashes."""
    known = {**os.environ, "WARP_CACHE_PATH": str(cache)}
    subprocess.run([sys.executable, "-c", PRELUDE + program], cwd=ROOT, env=known, check=True)
    return [path.name.removeprefix("wp_").split("_kernel_")[0] for path in cache.rglob("*.o")]


def test_a_kernel_is_compiled_once_in_any_order(tmp_path: Path) -> None:
    """One binary for each kernel of a rollout; the next process, in another order, adds none."""
    first = compiled(tmp_path, REPLAY)
    assert {name: Counter(first)[name] for name in ("settle", "rollout")} == {
        "settle": 1,
        "rollout": 1,
    }
    assert sorted(compiled(tmp_path, OTHER_WAY_ROUND)) == sorted(first)


def test_kernels_of_an_asset_are_called_alike_in_each_process() -> None:
    """Else each would compile them anew: 20 s for a hand with a ball."""
    first, second = (python("-c", NAMES).stdout for _ in range(2))
    assert [line for line in first.splitlines() if line.startswith("name settle")] == [
        line for line in second.splitlines() if line.startswith("name settle")
    ]
    assert first.count("name settle") == 2
