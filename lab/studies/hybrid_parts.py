"""What each part of the hybrid is worth, ``python -m lab.studies.hybrid_parts OUT --jobs 2``.

OUT is the folder of a `tendon-newton reproduce` whose hybrids are made. On every bench that is
there, or on `--units`, the servo with friction and its network pull the nominal tendon; the same
servo without a network the measured tendon; and all of it together. Prints the errors in closed
loop as the stages of a reproduction measure them, median and range over the benches.
"""

import argparse
import asyncio
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_lab.reproduction.closed_loop import OBSTACLES, replayed
from tendon_lab.reproduction.reproduction import Reproduction
from tendon_lab.reproduction.settings import FULL
from tendon_lab.reproduction.unit import Unit
from tendon_newton.actuators.networks.artifact import load_network, write_network
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.scheduler import JobOptions, open_executor

PARTS = {
    "nominal": "servo with friction, network, nominal tendon",
    "silent": "servo with friction, **no network**, measured tendon",
    "hybrid": "all three",
}
MEASURED = (
    "tip about 0.2 rad [mm]",
    "tip about pi/2 [mm]",
    "strong spring [N]",
    "contact ramps [N]",
    "finger's steps [N]",
)
TIME_STEP = 5.0e-4  # Longest step of the simulations [s]


def main() -> None:
    """Replay every bench with every part and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--units", type=int, nargs="+", default=[])
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    there = sorted(int(p.parent.name[5:]) for p in arguments.out.glob("models/unit_*/hybrid.toml"))
    with open_executor(JobOptions(jobs=arguments.jobs)) as executor:
        reproduction = Reproduction(
            settings=replace(FULL, units=tuple(arguments.units or there)),
            out=arguments.out,
            executor=executor,
        )
        items = [(place, part) for place in range(len(reproduction.units)) for part in PARTS]
        results = asyncio.run(reproduction.each(errors, items, keep=False))
        found = dict(zip(items, results, strict=True))
    print(f"over benches: {len(reproduction.units)}\n\n| | {' | '.join(MEASURED)} |")
    print("|---" * (len(MEASURED) + 1) + "|")
    for part, words in PARTS.items():
        benches = [own for (_, name), own in found.items() if name == part]
        cells = [
            f"{np.median(v):.2f} ({min(v):.2f} to {max(v):.2f})" for v in zip(*benches, strict=True)
        ]
        print(f"| {words} | {' | '.join(cells)} |")


def errors(reproduction: Reproduction, item: Sequence[object]) -> list[float]:
    """Return what is `MEASURED` of one bench with one part of its hybrid."""
    place, part = item
    assert isinstance(place, int)
    unit = reproduction.units[place]
    model = model_of(reproduction, unit, str(part))
    sines = [unit.find("finger", kind) for kind in ("open_sine", "closing_sine")]
    ramps = [unit.find("finger", f"contact_ramp_{name}") for name in OBSTACLES]
    groups = (unit.steps("spring_strong"), ramps, unit.steps("finger"))
    tips = [1.0e3 * run.tip_error for run in replayed(sines, model, time_step=TIME_STEP)]
    forces = [
        float(np.mean([run.force_error for run in replayed(group, model, time_step=TIME_STEP)]))
        for group in groups
    ]
    return [*tips, *forces]


def model_of(reproduction: Reproduction, unit: Unit, part: str) -> Model:
    """Return a bench's hybrid, or what is left of it without a part."""
    hybrid = load_model(reproduction.model_file(unit, "hybrid"))
    if part == "hybrid":
        return hybrid
    if part == "nominal":
        return load_model(reproduction.model_file(unit, "servo"))
    folder = reproduction.folder("networks", unit.name)
    file = load_network(Path(str(hybrid.actuator.values["file"])), trust=False)
    path = folder / "servo-without-network.pt"
    write_network(path, silent(file.module), file.card)
    values = {**hybrid.actuator.values, "file": str(path.resolve())}
    return replace(hybrid, actuator=replace(hybrid.actuator, values=values))


def silent(module: Any) -> Any:
    """Return a servo and its network with nothing of the network added."""
    module.share = 0.0
    return module


if __name__ == "__main__":
    main()
