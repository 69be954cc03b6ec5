"""What any policy could reach: the stairs' commands learned on the bench itself, climb after climb.

``python -m lab.studies.learned_climb 2001 2002 --out DIR`` lets the packaged policy climb on each
unit, then plays its commands back, moved by what the tip missed a little later on the same stair.
Nothing moves before its goal is known, as with a policy, but all else is known of this unit. The
least error of 24 climbs bounds what a policy can reach there, but for its noise.

Source: Arimoto, Kawamura, Miyazaki, Bettering operation of robots by learning (1984).
"""

import argparse
import json
import tempfile
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tendon_hardware.benches.bench import open_bench
from tendon_hardware.control.keyboard import Keyboard
from tendon_hardware.control.operator import Operator
from tendon_hardware.control.pilot import PilotStep, PolicyPilot
from tendon_hardware.control.policy_runner import Policy, load_policy
from tendon_hardware.deployment.deploy import Deployment, deploy
from tendon_hardware.deployment.deploy_log import step_table
from tendon_hardware.servos.base import ServoState
from tendon_hardware.stop_request import StopRequest
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.scheduler import JobOptions, completed
from tendon_newton.workflows.climbing import BENCH_DURATION
from tendon_newton.workflows.deployment import bench_address, free_log, goals_of, settings_of
from tendon_newton.workflows.options import DeployOptions, policy_file
from tendon_train.policy.scoring.bench_climb import climb_on_bench
from tendon_train.policy.scoring.evaluation_scores import score
from tendon_train.policy.scoring.policy_evaluation import Climb, reachable_error

CLIMBS = 24
LEAD = 2  # Steps of 50 ms by which a command is ahead of what it does [1]
GAIN = 2.0  # Spool angle by which a command moves for as much that the tip is off [1]
POLICY = policy_file(Path("finger-stairs"))


class Silent(Operator):
    """An operator whom nobody tells anything."""

    def tell(self, text: str) -> None:
        """Keep quiet."""

    announce = show = tell

    def ask(self, text: str) -> str:
        """Agree."""
        return ""


class Playback(PolicyPilot):
    """Gives commands [rad] one after the other, shape (T,), within the policy's own limits."""

    def __init__(self, policy: Policy, commands: Array) -> None:
        super().__init__(policy)
        self._commands = iter(commands.tolist())
        self._last = 0.0
        self._reach = policy.card.action_clip

    def step(self, states: Sequence[ServoState], goal: float) -> PilotStep:
        """Give the next command."""
        self._last = next(self._commands, self._last)
        here = states[0].position
        offset = float(np.clip(self._last - here, -self._reach, self._reach))
        own = super().step(states, goal)
        return replace(own, output=(offset,), action=(offset,), command=(here + offset,))


def climbed(unit: int, commands: Array | None, folder: Path) -> Climb:
    """Climb on a unit by commands [rad], shape (T,), or as the policy does."""
    policy, operator = load_policy(POLICY), Silent()
    options = DeployOptions(
        port=f"virtual:finger:{unit}", policy=POLICY, bench="finger", goals="stairs",
        duration=BENCH_DURATION, out=folder, split="test", faster_than_real_time=True,
    )  # fmt: skip
    settings = settings_of(options, policy)
    pilot = PolicyPilot(policy) if commands is None else Playback(policy, commands)
    address, given = bench_address(options, 1), {"estimate": None, "watch": None, "state": ""}
    with (
        closing(goals_of(options, policy, settings)) as goals,
        open_bench(address, operator.tell) as bench,
        StopRequest() as stop,
        Keyboard() as keyboard,
    ):
        run: Any = Deployment(
            bench=bench, pilot=pilot, settings=settings, goals=goals, policy=policy, **given
        )
        log = deploy(run, free_log(options), keyboard, operator, stop).path
    assert log is not None
    radius = policy.card.spool_radius
    return climb_on_bench("learned", log, step_table(log), load_mechanism("finger"), radius)


def moved(commands: Array, climb: Climb) -> Array:
    """Return commands [rad], shape (T,), moved by what the tip misses later on the same stair."""
    tip, goal = climb.tip_angle[:, 0], climb.goal
    count = min(len(commands), len(goal))  # a safety rule may end a climb
    ends = np.append(np.flatnonzero(np.diff(goal[:count])), count - 1)
    rows = np.arange(count)
    later = np.minimum(rows + LEAD, ends[np.searchsorted(ends, rows)])
    slope = np.polyfit(tip, climb.motor_position[:, 0], 1)[0]
    out, ranges = commands.copy(), load_policy(POLICY).card.command_ranges[0]
    out[:count] += GAIN * slope * (goal - tip)[later]
    return np.clip(out, *ranges)


def learned(unit: int, out: Path) -> str:
    """Learn a climb on a unit; keep each climb's errors [m] and say the first and the best."""
    path, mechanism = out / f"unit_{unit}.json", load_mechanism("finger")
    if not path.exists():
        errors, commands = list[tuple[float, float]](), None
        with tempfile.TemporaryDirectory() as folder:
            for _ in range(CLIMBS):
                climb = climbed(unit, commands, Path(folder))
                commands = climb.command[:, 0] if commands is None else commands
                if len(climb.goal) >= len(commands):
                    found = score(climb, reachable_error(mechanism, climb.goal))
                    errors.append((found.rmse, found.settled_error))
                commands = moved(commands, climb)
        write_json(path, {"rmse": [e for e, _ in errors], "settled_error": [s for _, s in errors]})
    rmse = 1e3 * np.array(json.loads(path.read_text())["rmse"])
    return f"unit {unit}: the policy misses {rmse[0]:.2f} mm, learned commands {rmse.min():.2f}"


def main() -> None:
    """Print a line for each unit and the mean."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("units", type=int, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    jobs = JobOptions(jobs=chosen.jobs)
    for _, said in completed(partial(learned, out=chosen.out), chosen.units, jobs):
        print(said, flush=True)
    least = [
        min(json.loads((chosen.out / f"unit_{u}.json").read_text())["rmse"]) for u in chosen.units
    ]
    print(f"mean of {len(least)}: {1e3 * np.mean(least):.2f} mm")


if __name__ == "__main__":
    main()
