"""Let a policy drive a finger, on a real bench or a virtual one, with every tick logged.

Without any hardware, goals from the arrow keys:
  tendon-newton deploy --policy policy.onnx --port virtual

On a bench that is plugged in; first by hand, then with the motor off, then for good:
  tendon-newton deploy --jog --port /dev/ttyUSB0
  tendon-newton deploy --policy policy.onnx --port /dev/ttyUSB0 --dry-run
  tendon-newton deploy --policy policy.onnx --port /dev/ttyUSB0 --load-cell-port /dev/ttyACM0
  --calibration cell.toml --goals stairs

A policy of several servos, all on one bus, with the IDs 1, 2, ...; and one of them by hand:
  tendon-newton deploy --policy policy.onnx --port virtual:finger_antagonist
  tendon-newton deploy --jog --port /dev/ttyUSB0 --servo-id 2

Does this policy still do what it did in that log?
  tendon-newton deploy --policy policy.onnx --replay deployments/policy_0.mcap

Keys: up and down move the goal, 0 to 9 set it; space or q lets the tendon out and ends the run; x
switches the motor off at once. Ctrl-C, a closed terminal and SIGTERM do what the space bar does.
Logs are recordings: `tendon-newton diagnose` and `tendon-newton plot` take them.
"""

from tendon_newton.cli.terminal import Terminal
from tendon_newton.workflows.options import DeployOptions


def main(config: DeployOptions) -> None:
    """Deploy, replay or jog, and say what came of it."""
    from tendon_newton.workflows.deployment import drive, replay

    with Terminal() as operator:
        if config.replay is None:
            drive(config, operator)
        else:
            replay(config, operator)
