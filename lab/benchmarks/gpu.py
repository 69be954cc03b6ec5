"""What a control step of many fingers costs, part by part, against Newton's and MuJoCo's engines.

Run from the root of the repository, on a machine with a GPU::

    python -m lab.benchmarks.gpu                      # everything
    python -m lab.benchmarks.gpu --parts network  # some of it
    python -m lab.benchmarks.gpu --figure             # only draw and list it
    python -m lab.benchmarks.gpu --device cpu --worlds 64 --parts mechanics network \
        --out build/dry_run.json                        # a dry run

It writes ``lab/benchmarks/results/gpu.json``, where each part that is measured takes the place of
the former one, and ``docs/images/cost_by_worlds.png``. A control step is 50 ms in one CUDA graph;
times are the best of seven spans by the clock, everything warm. No engine is timed before its
states are near the reference (`soundness`), and each runs at its largest step at which they are.

Parts: ``mechanics``; the ``network`` (the authors' Transformer, 6,801 numbers). `training` times
hands with a ball, fingers with that network, and learning.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import warp as wp

from lab.benchmarks.engines_timed.soundness import CONTROL_STEP
from lab.benchmarks.mechanics import mechanics
from lab.benchmarks.network import network
from lab.benchmarks.timing import RESULTS, Row, circumstances

RESULT = RESULTS / "gpu.json"
FIGURE = Path(__file__).parents[2] / "docs" / "images" / "cost_by_worlds.png"
WORLDS = (1, 64, 1024, 4096, 16384, 65536, 262144)
PARTS: dict[str, Callable[[Sequence[int]], Iterator[Row]]] = {
    "mechanics": mechanics,
    "network": network,
}


def measure(
    parts: dict[str, Callable[[Sequence[int]], Iterator[Row]]],
    worlds: Sequence[int],
    out: Path,
    command: str,
) -> dict[str, Any]:
    """Measure parts, write each row as it comes, and return all that the file holds."""
    wp.config.quiet = True
    result = json.loads(out.read_text()) if out.exists() else {}
    out.parent.mkdir(parents=True, exist_ok=True)
    for name, part in parts.items():
        rows: list[Row] = []
        head = circumstances(command.format(part=name))
        for row in part(worlds):
            rows.append(row)
            result[name] = {**head, "rows": rows}
            out.write_text(json.dumps(result, indent=1) + "\n")
    return result


def tell(result: dict[str, Any]) -> str:
    """Return the rows that several engines share, as a table for `docs/speed.md`."""
    lines = [
        "| part | worlds | engine | step | error | control step |",
        "|---|---|---|---|---|---|",
    ]
    for part in PARTS:
        for row in result.get(part, {}).get("rows", []):
            step, error = "", ""
            if "error_rad" in row:
                step = f"{row['step_milliseconds']:.2f} ms"
                error = f"{1e3 * row['error_rad']:.1f} mrad"
            elif "largest_error_n" in row:
                error = f"{row['largest_error_n']:.2g} N"
            cells = [part, f"{row['worlds']:,}", row["engine"], step, error]
            lines.append(f"| {' | '.join(cells)} | {row['milliseconds']:.3g} ms |")
    return "\n".join(lines)


def draw(result: dict[str, Any]) -> None:
    """Draw the time of a control step against the number of worlds."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(8, 4.5), sharey=True, layout="constrained")
    for axis, part in zip(axes, PARTS, strict=True):
        rows = result.get(part, {}).get("rows", [])
        for engine in dict.fromkeys(row["engine"] for row in rows):
            points = [(r["worlds"], r["milliseconds"]) for r in rows if r["engine"] == engine]
            axis.loglog(*zip(*points, strict=True), marker="o", label=engine)
        axis.set(title=part, xlabel="worlds")
        axis.grid(alpha=0.3)
        if rows:
            axis.legend(fontsize=8, loc="upper left")
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(low, 20.0 * high)  # room for the legends
    axes[0].set_ylabel(f"one control step of {1e3 * CONTROL_STEP:.0f} ms [ms]")
    figure.savefig(FIGURE, dpi=120)


def main() -> None:
    """Measure what was asked for, write as it comes, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--parts", nargs="*", choices=PARTS, default=list(PARTS))
    parser.add_argument("--worlds", nargs="*", type=int, default=WORLDS, help="how many")
    parser.add_argument("--device", default="cuda:0", help="Warp's name of it")
    parser.add_argument("--out", type=Path, default=RESULT)
    parser.add_argument(
        "--figure", action="store_true", help="only draw and list what was measured"
    )
    arguments = parser.parse_args()
    if arguments.figure:
        result = json.loads(arguments.out.read_text())
        sys.stdout.write(tell(result) + "\n")
        draw(result)
        return
    with wp.ScopedDevice(arguments.device):
        parts = {name: PARTS[name] for name in arguments.parts}
        command = "python -m lab.benchmarks.gpu --parts {part}"
        result = measure(parts, arguments.worlds, arguments.out, command)
    if arguments.out == RESULT:
        draw(result)


if __name__ == "__main__":
    main()
