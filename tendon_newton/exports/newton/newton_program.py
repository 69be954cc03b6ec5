"""The Python file beside an exported bench: a drive for Newton with the model's own law."""

from collections.abc import Mapping
from textwrap import indent
from typing import Any

from tendon_newton.exports.linking import Linker
from tendon_newton.exports.model_law import ModelLaw
from tendon_newton.exports.newton import drive, drive_types
from tendon_newton.exports.runtime import networks, rows

# Modules of the program, in the order in which they are joined
MODULES = (drive_types, networks, drive, rows)
USE = """import newton, tendon_drive

tendon_drive.register()                     # lets add_usd know the drive
builder = newton.ModelBuilder()
newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
builder.add_usd("bench_drive.usda")
model = builder.finalize()                  # model.actuators has the drive
"""

DOCSTRING = (
    """An identified tendon servo as a drive for Newton's actuators.

Made by tendon-newton export. It needs newton 1.8 with MuJoCo and USD. The file `bench_drive.usda`
names the drive:

"""
    + indent(USE, "    ")
    + """
Write the desired motor angle [rad] of a tendon into `control.joint_target_q` of each joint that the
tendon drives. Each joint has one slot of the drive; slots of one tendon reckon the same force. In a
loop of your own:

    bench = tendon_drive.Simulation(worlds=4096)
    bench.reset([0.5])                            # desired motor angles [rad], one per tendon
    bench.command([1.0])
    bench.step(100)                               # of TIME_STEP
    print(bench.read())                           # angle [rad], speed [rad/s], force [N]

or: python tendon_drive.py commands.csv --out replay.csv     (columns t [s] and theta_d [rad])
"""
)


def drive_text(law: ModelLaw, known: Mapping[str, Any]) -> str:
    """Return the Python file of a drive that knows some facts."""
    return Linker(law, device=True).program(DOCSTRING, known, MODULES, last="run(Simulation)")
