"""Let policies climb the stairs on many virtual benches, and compare what they were trained on.

``python -m lab.studies.policy_transfer policies/*/policy.onnx --out DIR --jobs 4``. A
policy's folder names it: NAME-SEED. DIR gets one file per policy and unit, so that a run that broke
off goes on; transfer.md with a row for each training, compared with the best of those whose names
begin with ideal or refit; and policy_transfer.json with the figures of all climbs.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import tempfile
from collections import defaultdict
from collections.abc import Mapping
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from tendon_hardware.virtual_bench.physics.constants import BENCH_SEEDS
from tendon_newton.cli import main as run_verb
from tendon_newton.scheduler import JobOptions, completed

FIGURES = ("rmse", "rising_rmse", "falling_rmse", "settled_error")  # Numbers of a climb [m]
IDEALS = ("ideal", "refit")  # How the names of policies begin that were trained on an ideal source
Table = Mapping[str, Mapping[int, Mapping[int, Any]]]  # Name, seed and unit of each climb


def main() -> None:
    """Climb where nobody has, and write the tables."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("policies", nargs="*", type=Path)
    words.add_argument("--out", type=Path, required=True)
    words.add_argument("--units", nargs="+", type=int, default=list(BENCH_SEEDS))
    words.add_argument("--jobs", type=int, default=1)
    told = words.parse_args()
    told.out.mkdir(parents=True, exist_ok=True)
    climbs = [(policy, unit, told.out) for policy in told.policies for unit in told.units]
    missing = [each for each in climbs if not file_of(*each).exists()]
    options = JobOptions(jobs=told.jobs)
    for _, done in completed(climb, missing, options):
        print(done, flush=True)
    write_tables(told.out, told.units)


def file_of(policy: Path, unit: int | str, out: Path) -> Path:
    """Return where a climb's numbers stand."""
    return out / f"{policy.resolve().parent.name}.unit_{unit}.json"


def climb(what: tuple[Path, int | str, Path]) -> str:
    """Let one policy climb on one unit, keep its numbers, and say in a line how it went.

    A unit may be 7_friction: number 7 whose gear has run dry.
    """
    policy, unit, out = what
    place = str(unit).replace("_", ":")
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        code = run_verb(
            [
                "evaluate-policy",
                str(policy),
                "--port",
                f"virtual:finger:{place}",
                "--out",
                folder,
                "--faster-than-real-time",
                "--no-plots",
                "--force",
            ]
        )
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
    best = best_ideal(table)
    lines = [
        "| trained on | seeds | units | tip error, RMS: median (range) [mm] | closing | opening "
        "| settled | median of each seed | less than the best ideal | least motor angle [rad] |",
        "|---|---|---|---|---|---|---|---|---|---|",
        *(row(name, seeds, best) for name, seeds in sorted(table.items())),
    ]
    (out / "policy_transfer.json").write_text(figures_of(table))
    (out / "transfer.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


def figures_of(table: Table) -> str:
    """Return the figures of all climbs as JSON, a line for each policy."""
    lines = [
        f'  "{name}-{seed}": '
        + json.dumps(
            {
                unit: [round(1e3 * found[figure], 2) for figure in FIGURES]
                + [round(found.get("least_motor_angle", nan), 3)]
                for unit, found in sorted(units.items())
            }
        )
        for name, seeds in sorted(table.items())
        for seed, units in sorted(seeds.items())
    ]
    names = json.dumps([*(f"{figure} [mm]" for figure in FIGURES), "least motor angle [rad]"])
    return f'{{\n "figures": {names},\n "climbs": {{\n' + ",\n".join(lines) + "\n }\n}\n"


def mean_error(seeds: Mapping[int, Mapping[int, Any]], unit: int) -> float:
    """Return the mean error of all seeds on a unit [m]."""
    return float(np.mean([units[unit]["rmse"] for units in seeds.values() if unit in units]))


def best_ideal(table: Table) -> dict[int, float]:
    """Return the error of the best training on an ideal source on each unit [m]."""
    ideals = [seeds for name, seeds in table.items() if name.startswith(IDEALS)]
    known = {unit for seeds in ideals for units in seeds.values() for unit in units}
    return {
        unit: min(
            mean_error(seeds, unit) for seeds in ideals if any(unit in u for u in seeds.values())
        )
        for unit in known
    }


def row(name: str, seeds: Mapping[int, Mapping[int, Any]], best: Mapping[int, float]) -> str:
    """Return one training's row."""
    climbs = [found for units in seeds.values() for found in units.values()]
    rms, closing, opening, settled = (
        1e3 * np.array([found[figure] for found in climbs]) for figure in FIGURES
    )
    units = {unit for own in seeds.values() for unit in own} & set(best)
    less = [100.0 * (1.0 - mean_error(seeds, unit) / best[unit]) for unit in units]
    reduction = f"{min(less):.0f} to {max(less):.0f} %" if less else "-"
    least = min(found.get("least_motor_angle", nan) for found in climbs)
    own = ", ".join(
        f"{1e3 * np.median([found['rmse'] for found in units.values()]):.1f}"
        for _, units in sorted(seeds.items())
    )
    return (
        f"| {name} | {len(seeds)} | {max(map(len, seeds.values()))} | {np.median(rms):.2f} "
        f"({rms.min():.1f} to {rms.max():.1f}) | {np.median(closing):.1f} | "
        f"{np.median(opening):.1f} | {np.median(settled):.1f} | {own} | {reduction} | "
        f"{least:.2f} |"
    )


if __name__ == "__main__":
    main()
