"""Run one command through several simulators, and draw how far they lie apart.

Writes compare.png and compare.md. All are measured against our own solver.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True, kw_only=True)
class CompareConfig:
    """Which model, and which simulators."""

    model: Annotated[Path, tyro.conf.Positional]
    """Model file, or a diagnosis: its folder or its diagnosis.json."""
    simulators: tuple[str, ...] = ("newton", "mujoco", "mjcf")
    """Others than ours. Exports are run by newton (its drive), prims (Newton's own alone), mujoco
    (its program) and mjcf (its file alone); solver_mujoco is Newton's SolverMuJoCo under our own
    servo."""
    out: Path = Path("comparison")  # Folder for picture and table; made if it is not there.
    bench: str | None = None
    """Bench; by default that of the recordings or of the diagnosis, else the
    finger."""
    dataset: Path | None = None
    """Dataset whose recordings are run; by default some steps and a sine."""
    seconds: float = 20.0  # Time of the dataset's commands that is run [s]; inf takes all.
    trust: bool = False
    """Trust the network's file from now on: it is a program that runs with your rights."""


def main(config: CompareConfig) -> None:
    """Run, draw and print the table."""
    from tendon_newton.data.files.output_folder import make_folder
    from tendon_newton.data.files.text_file import write_text
    from tendon_newton.device_code.quiet import quiet_warp
    from tendon_newton.exports.comparison import compare, comparison_table, plot_comparison
    from tendon_newton.exports.source import read_source

    quiet_warp()
    source = read_source(config.model, config.bench, config.dataset, config.seconds)
    out = make_folder(config.out)
    found = compare(
        config.simulators, source.mechanism, source.model, source.runs, trust=config.trust
    )
    plot_comparison(out / "compare.png", found)
    table = comparison_table(found)
    write_text(out / "compare.md", table + "\n")
    print(table)
    print(f"\nwrote compare.png and compare.md to {out}")
