"""Let policies climb the stairs on many virtual benches, and compare what they were trained on.

``python -m tests.results.policy_transfer policies/*/policy.onnx --out DIR --cores 4``. A policy's
folder names it: NAME-SEED. DIR gets one file per policy and unit, so that a run that broke off goes
on, and transfer.json and transfer.md with all of them.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import tempfile
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from hardware.virtual_bench.constants import BENCH_SEEDS
from tendon_newton.cli import main as run_verb

FIGURES = ("rmse", "rising_rmse", "falling_rmse", "settled_error")
"""Numbers of a climb [m]."""


def main() -> None:
    """Climb where nobody has, and write the tables."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("policies", nargs="*", type=Path)
    words.add_argument("--out", type=Path, required=True)
    words.add_argument("--units", nargs="+", type=int, default=list(BENCH_SEEDS))
    words.add_argument("--cores", type=int, default=1)
    told = words.parse_args()
    told.out.mkdir(parents=True, exist_ok=True)
    climbs = [(policy, unit, told.out) for policy in told.policies for unit in told.units]
    missing = [each for each in climbs if not file_of(*each).exists()]
    with ProcessPoolExecutor(told.cores, mp_context=get_context("spawn")) as pool:
        for done in as_completed([pool.submit(climb, *each) for each in missing]):
            print(done.result(), flush=True)
    write_tables(told.out, told.units)


def file_of(policy: Path, unit: int, out: Path) -> Path:
    """Return where a climb's numbers stand."""
    return out / f"{policy.resolve().parent.name}.unit_{unit}.json"


def climb(policy: Path, unit: int, out: Path) -> str:
    """Let one policy climb on one unit, keep its numbers, and say in a line how it went."""
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        code = run_verb(
            ["evaluate-policy", str(policy), "--port", f"virtual:finger:{unit}", "--out", folder,
             "--faster-than-real-time", "--no-plots", "--force"]
        )  # fmt: skip
        if code:
            return f"{policy} on unit {unit}: exit code {code}"
        (found,) = json.loads((Path(folder) / "evaluation.json").read_text())["climbs"]
    path = file_of(policy, unit, out)
    path.with_suffix(".draft").write_text(json.dumps({"unit": unit, **found}, indent=1))
    path.with_suffix(".draft").replace(path)
    return f"{path.stem}: {1e3 * found['rmse']:.2f} mm"


def write_tables(out: Path, units: list[int]) -> None:
    """Write all climbs that there are, and a row for each training, over its seeds and units."""
    table: dict[str, dict[int, dict[int, Any]]] = defaultdict(lambda: defaultdict(dict))
    for path in sorted(out.glob("*.unit_*.json")):
        found = json.loads(path.read_text())
        name, _, seed = path.name.split(".unit_")[0].rpartition("-")
        if found["unit"] in units:
            table[name][int(seed)][found["unit"]] = found
    lines = [
        "| trained on | seeds | units | tip error, RMS: median (range) [mm] | closing | opening "
        "| settled | median of each seed |",
        "|---|---|---|---|---|---|---|---|",
        *(row(name, seeds) for name, seeds in sorted(table.items())),
    ]
    (out / "transfer.json").write_text(json.dumps(table, indent=1))
    (out / "transfer.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


def row(name: str, seeds: dict[int, dict[int, Any]]) -> str:
    """Return one training's row."""
    climbs = [found for units in seeds.values() for found in units.values()]
    rms, closing, opening, settled = (
        1e3 * np.array([found[figure] for found in climbs]) for figure in FIGURES
    )
    own = ", ".join(
        f"{1e3 * np.median([found['rmse'] for found in units.values()]):.1f}"
        for _, units in sorted(seeds.items())
    )
    return (
        f"| {name} | {len(seeds)} | {max(map(len, seeds.values()))} | {np.median(rms):.2f} "
        f"({rms.min():.1f} to {rms.max():.1f}) | {np.median(closing):.1f} | "
        f"{np.median(opening):.1f} | {np.median(settled):.1f} | {own} |"
    )


if __name__ == "__main__":
    main()
