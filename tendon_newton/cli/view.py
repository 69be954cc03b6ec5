"""Look at logs in rerun: finger, tensions, angles, goal and what the safety rules did.

  tendon-newton view deployments/finger-stairs_0.mcap
  tendon-newton view recordings --to file        # NAME.rrd beside each log, without a display
  tendon-newton view recordings --model diagnosis # simulated beside measured

The finger stands in the friction-free equilibrium of the measured motor angle.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro


@dataclass(frozen=True, kw_only=True)
class ViewConfig:
    """The logs, and where they are shown."""

    logs: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Logs of collect and deploy (.mcap), recordings (.csv), or folders of them."""
    model: Path | None = None
    """Model file, a diagnosis, or a known servo: what it makes of the commands is shown beside what
    was measured."""
    to: Literal["window", "file"] = "window"
    """Whether a window opens, or files (.rrd) are written beside the logs to be opened later."""


def main(config: ViewConfig) -> None:
    """Show them."""
    from tendon_newton.device_code.quiet import quiet_warp
    from tendon_newton.errors import InvalidParameter

    quiet_warp()
    from tendon_newton.workflows.viewing import logs_of, show_log, show_model

    if not config.logs:
        raise InvalidParameter("a view needs a log, or a folder of logs")
    for log in logs_of(config.logs):
        named = config.model
        scene = show_log(log, config.to) if named is None else show_model(log, named, config.to)
        target = scene.target
        print(f"{log}: {'shown in a window' if target is None else target}")
