"""Draw a log of a deployment or a recording as a picture, on a computer without a display too.

  tendon-newton plot deployments/policy_0.mcap
  tendon-newton plot recordings/finger_chirp_0.mcap --model diagnosis   # simulated beside measured

writes deployments/policy_0.svg, which every browser shows: goal and tip, or the turn of a
ball, spool and command, tension, and how late the loop was: median, least and greatest. The verb
needs neither matplotlib nor a display.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.errors import InvalidParameter

if TYPE_CHECKING:
    from tendon_newton.data.recording import Array, Recording


@dataclass(frozen=True, kw_only=True)
class PlotConfig:
    """The log, and the file of the picture."""

    log: tyro.conf.Positional[Path]
    """Log of `deploy` or `collect` (.mcap), or a recording as `import` and `simulate` write it
    (.csv)."""
    model: Path | None = None
    """Model file, a diagnosis, or a known servo: what it makes of the commands is drawn beside what
    was measured."""
    out: Path | None = None  # The picture; beside the log unless given.


def main(config: PlotConfig) -> None:
    """Draw it."""
    from tendon_hardware.deployment.deploy_plot import panels_of, title_of
    from tendon_hardware.deployment.svg_panels import draw
    from tendon_newton.data.dataset import listed_files, load_recording
    from tendon_newton.data.files.text_file import write_text

    folder = config.log.is_dir() and not (config.log / "metadata.yaml").is_file()
    if folder or (config.log.is_file() and config.log.suffix not in (".mcap", ".csv", ".db3")):
        own = [config.log / name for name in listed_files(config.log)] if folder else []
        such = f", such as {own[0]}" if own else ""
        raise InvalidParameter(f"{config.log}: a picture is of one log, .mcap, .csv{such}")
    out = config.out or config.log.with_suffix(".svg")
    if out.suffix != ".svg":
        raise InvalidParameter(f"{out}: the picture is an SVG file, named .svg")
    recording = load_recording(config.log)
    simulated = None if config.model is None else simulated_by(config.model, recording)
    panels = panels_of(recording, config.log, simulated)
    picture = draw(panels, title_of(config.log, panels))
    write_text(out, picture)
    print(out)


def simulated_by(model: Path, recording: "Recording") -> "tuple[Array, Array]":
    """Return the spool angles [rad] and tensions [N] of a model, shape (T, D) each."""
    quiet_warp()
    from tendon_newton.diagnosis.diagnosed_bench import open_model
    from tendon_newton.mechanisms.loading import load_mechanism
    from tendon_newton.simulation.hosts.replay import replay

    own = open_model(model, [load_mechanism(recording.bench)])
    (trajectory,) = replay([recording], own)
    return trajectory.motor_position, trajectory.force
