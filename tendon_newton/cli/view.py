"""Look at logs in rerun: finger, tensions, angles, goal and what the safety rules did.

  tendon-newton view deployments/finger-stairs_0.mcap
  tendon-newton view recordings --to file        # NAME.rrd beside each log, without a display
  tendon-newton view recordings --model diagnosis # simulated beside measured

The finger stands in the friction-free equilibrium of the measured motor angle. The verbs collect,
deploy and simulate show the same as it happens: --view window.
"""

import os
import subprocess
import time
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

READY = "ready"  # Word of a viewer that has loaded what it needs.
POLITENESS = 10  # How far a viewer stands back behind the loop that drives the bench (nice).
LAST_LOOK = 20.0
"""Time that a viewer has to show the rest of a log after its program has ended [s]."""


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
    follow: float | None = None
    """Show logs that begin in a folder after this date [s since 1970] as they are written, until
    the standard input ends."""


def main(config: ViewConfig) -> None:
    """Show them."""
    from tendon_newton.device_code.quiet import quiet_warp
    from tendon_newton.errors import InvalidParameter

    quiet_warp()
    from tendon_newton.workflows.viewing import (
        end_of_input,
        follow,
        logs_of,
        show_log,
        show_model,
    )

    if not config.logs:
        raise InvalidParameter("a view needs a log, or a folder of logs")
    if config.follow is not None:
        folder, *others = config.logs
        if others:
            raise InvalidParameter("--follow watches one folder")
        os.nice(POLITENESS)
        print(READY, flush=True)
        follow(folder, config.to, config.follow, end_of_input())
        return
    for log in logs_of(config.logs):
        named = config.model
        scene = show_log(log, config.to) if named is None else show_model(log, named, config.to)
        target = scene.target
        print(f"{log}: {'shown in a window' if target is None else target}")


@contextmanager
def watched(folder: Path, to: Literal["window", "file"] | None) -> Generator[None]:
    """Let another process show the logs that are written to a folder meanwhile.

    The process that drives a bench loads neither rerun nor the simulator for it.
    """
    import importlib.util

    from tendon_newton.errors import MissingDependency
    from tendon_newton.safe_path import python_command

    if to is None:
        yield
        return
    if importlib.util.find_spec("rerun") is None:
        raise MissingDependency(
            "--view needs the package 'rerun-sdk', which is not installed; "
            "pip install 'tendon-newton[view]'"
        )
    words = ["view", str(folder), "--follow", str(time.time()), "--to", to]
    program = python_command("-m", "tendon_newton", *words)
    viewer = subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert viewer.stdin is not None
    assert viewer.stdout is not None
    viewer.stdout.readline()  # loading takes seconds, which would make a loop late
    try:
        yield
    finally:
        viewer.stdin.close()  # as the end of this process does, however it comes
        try:
            viewer.wait(LAST_LOOK)
        except subprocess.TimeoutExpired:
            viewer.terminate()
            viewer.wait()
        viewer.stdout.close()
