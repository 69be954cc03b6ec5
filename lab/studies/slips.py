"""How well is the slip of a spool found, and what does a policy do that knows it?

Usage: ``.venv/bin/python -m lab.studies.slips FOLDER --out OUT [--seeds 0 1 2 3]``.

``FOLDER`` holds units' models and the policies that have learned on them, as `lab.studies.refresh`
leaves them; ``--policy`` is one for all units. The
policy climbs the stairs on the unit as it was, and the stairs and goals at random on the unit whose
spool has slipped. How far it has is found with and without the first log. Then the policy climbs
there again with what it reads of the angle less what was found: nothing is trained.
"""

import argparse
from pathlib import Path

import numpy as np
import onnx
from onnx import numpy_helper

from lab.studies.refresh import DURATION, STAIRS, fly, random_goals
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.deploy_log import policy_span, step_table
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_hardware.virtual_bench.physics.wear import worn
from tendon_newton.data.model_file import load_model
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_train.policy.scoring.bench_climb import climb_on_bench
from tendon_train.policy.scoring.evaluation_scores import score
from tendon_train.policy.scoring.policy_evaluation import reachable_error
from tendon_train.refresh.refresh_logs import read_logs, without_beginning
from tendon_train.refresh.slip import find_slip, slip_since


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--policy", type=Path, help="for all units; by default, each has its own")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, nargs="*", default=[0, 1, 2, 3])
    arguments = parser.parse_args()
    quiet_warp()
    for seed in arguments.seeds:
        folder = arguments.folder
        policy = arguments.policy or folder / "policies" / f"diagnosed_{seed}-0" / "policy.onnx"
        model = folder / f"answer_{seed}" / "model.toml"
        print(measured(seed, policy, model, arguments.out / f"unit_{seed}"))


def measured(seed: int, policy: Path, model: Path, out: Path) -> str:
    """Find the slip of a unit's spool, let the policy know it, and say what came of it."""
    port = f"virtual:finger:{seed}"
    before = fly(policy, out / "stairs_new", port, "stairs", STAIRS)
    after = fly(policy, out / "stairs_spool", f"{port}:spool", "stairs", STAIRS)
    goals = random_goals(out / "goals_later.txt", 2 * seed + 1)
    longer = fly(policy, out / "later_spool", f"{port}:spool", goals, DURATION)
    new, later = (
        [without_beginning(log) for log in read_logs(paths, policy_span)]
        for paths in ([before], [after, longer])
    )
    found = slip_since(new, later)
    assert found is not None, "too little turns in these logs"
    shifted = shifted_policy(policy, found, out / "shifted.onnx")
    again = fly(shifted, out / "stairs_shifted", f"{port}:spool", "stairs", STAIRS)
    tips = [f"{1e3 * tip_error(policy, log):.1f}" for log in (before, after, again)]
    return (
        f"unit {seed} slipped {true_slip(seed):.3f} rad, found {found:.3f}, without the first log "
        f"{find_slip(later, load_model(model)).offset:.3f}; tip on the stairs, RMS: new {tips[0]}, "
        f"slipped {tips[1]}, known {tips[2]} mm"
    )


def true_slip(seed: int) -> float:
    """Return how far the spool of a unit slips [rad]."""
    unit = draw_unit("finger", seed)
    return (worn(unit, "spool").tendon.slack - unit.tendon.slack) / unit.servo.spool_radius


def shifted_policy(policy: Path, slip: float, path: Path) -> Path:
    """Write a policy that reads the motor's angle less a slip [rad]; its actions are relative."""
    network = onnx.load(str(policy))
    channels = [name for name, _ in load_policy(policy).card.observation]
    means = next(node for node in network.graph.node if node.op_type == "Sub").input
    for tensor in network.graph.initializer:
        if tensor.name in means:
            mean = numpy_helper.to_array(tensor).copy()
            mean.reshape(-1)[channels.index("theta") :: len(channels)] += np.float32(slip)
            tensor.CopyFrom(numpy_helper.from_array(mean, tensor.name))
    path.parent.mkdir(parents=True, exist_ok=True)
    onnx.save(network, str(path))
    return path


def tip_error(policy: Path, log: Path) -> float:
    """Return the tip's error of a climb, RMS [m]."""
    mechanism = load_mechanism("finger")
    radius = load_policy(policy).card.spool_radius
    climb = climb_on_bench("policy", log, step_table(log), mechanism, radius)
    return score(climb, reachable_error(mechanism, climb.goal)).rmse


if __name__ == "__main__":
    main()
