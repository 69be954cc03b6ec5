"""Go from the logs of a worn bench to a corrected model and a policy that knows it, unattended.

  tendon-newton refresh deployments --model model.toml --policy learned/policy.onnx --out refreshed

The logs are those of `tendon-newton deploy`. They are held against the model that fitted the bench:
has it drifted, and what is it? If it has, what was found goes into the model, and the policy is
trained on from its last checkpoint. --policy is a file that `train-policy` wrote, with its
policy.json and checkpoints beside it.

With logs of the time when the bench was new, so that old and new can be compared; and with a bench
on which the new policy is tried:
  tendon-newton refresh deployments/policy_4.mcap --reference deployments/policy_0.mcap
  --model model.toml --policy learned/policy.onnx --port virtual:finger:3:spool --out refreshed

OUT gets diagnosis/ (what `diagnose` writes), model.toml, training/policy.onnx, refresh.json and
refresh.html, one page. The same command goes on where it was interrupted; more --iterations go on
with a finished training.
"""

from tendon_newton.cli.terminal import Terminal
from tendon_newton.workflows.options import RefreshOptions


def main(config: RefreshOptions) -> None:
    """Find the drift, correct the model, train on, and say what came of it."""
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()

    from tendon_newton.workflows.refreshing import refresh

    with Terminal() as operator:
        refresh(config, operator)
