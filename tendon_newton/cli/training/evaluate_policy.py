"""Let policies follow stairs of goals, in simulation and on a bench, and compare them.

  tendon-newton evaluate-policy ideal/policy.onnx learned/policy.onnx --out comparison
  --force ideal found/model.toml

The goals are the paper's: from 0 to pi/2 and back by pi/10, resting 1.5 s on each. In simulation a
policy runs step for step as it is deployed, against each force model that is named, in the nominal
finger and in as many further ones as --worlds asks for, whose numbers are drawn.

On a bench, real or virtual, whose logs are kept, and on logs of `deploy --goals stairs`:
  tendon-newton evaluate-policy learned/policy.onnx --out comparison --port /dev/ttyUSB0
  tendon-newton evaluate-policy learned/policy.onnx --out comparison --logs deployments/run_0.mcap

Policies that turn a ball do so for a minute in hands that differ, and are told in radians and drops
per minute:
  tendon-newton evaluate-policy turning/policy.onnx --worlds 16 --out comparison

OUT gets evaluation.json with every number, evaluation.md with the table, and climb.png.
"""

from tendon_newton.cli.terminal import Terminal
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.workflows.options import ClimbOptions


def main(config: ClimbOptions) -> None:
    """Evaluate, write and print the table."""
    quiet_warp()

    from tendon_newton.workflows.climbing import compare_policies

    with Terminal() as operator:
        found = compare_policies(config, operator)
    print(found.text)
    least = found.scores[0].stairs[0] if found.scores else None
    if least is not None and least.reachable_error > 0.0:  # what no policy can avoid
        print(
            f"At goal {least.goal:.2f} rad no policy gets nearer than "
            f"{1e3 * least.reachable_error:.1f} mm: gravity bends the open finger."
        )
    print(f"wrote {', '.join(map(str, found.files))}")
