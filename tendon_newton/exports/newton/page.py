"""How a user loads an export to Newton."""

from __future__ import annotations


def loading_text(*, network: bool, plain: bool, stray: float) -> str:
    """Return how a user loads the files.

    Args:
        network: Whether a force network is asked.
        plain: Whether Newton's own prims say the servo.
        stray: Most by which a tendon's way in the drive strays from the bench's [m].
    """
    packages = '"newton[sim,importers]==1.8.*"' + (" onnxruntime" if network else "")
    return f"""```sh
pip install {packages}
python tendon_drive.py commands.csv --out replay.csv   # columns t [s] and theta_d [rad]
```

In a program of your own:

```python
import newton, tendon_drive

tendon_drive.register()                     # lets add_usd know the drive
builder = newton.ModelBuilder()
newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
builder.add_usd("bench_drive.usda")
model = builder.finalize()                  # model.actuators has the drive
```

Write a tendon's desired motor angle [rad] into `control.joint_target_q` of each joint that the
tendon drives, then call `model.actuators[0].step` and the solver with steps of 0.1 ms or less.
`tendon_drive.Simulation(worlds)` does all that for many worlds.
{ROUTED.format(1e6 * stray) if stray else ""}{PLAIN if plain else NOT_PLAIN}"""


ROUTED = """
The drive has the way of a routed tendon as a polynomial of the joints, which strays by {:.1f} um at
most inside the joints' range.
"""
PLAIN = """
`bench_newton.usda` needs no file of ours: Newton's own actuator prims, for steps of 0.1 ms. Its
target is the joint's position: command less offset, over the gearing. A string pushes there too.
"""
NOT_PLAIN = """
Newton's own actuator prims drive one joint each, and cannot say a tendon over several joints, or a
force network that sees command and angle apart. So there is no file with these alone.
"""
