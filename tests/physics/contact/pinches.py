"""Two fingers that face each other, for the tests of links that meet."""

from pathlib import Path

from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism

PINCH = """#usda 1.0
(
    defaultPrim = "pinch"
    upAxis = "Z"
    metersPerUnit = 1
    kilogramsPerUnit = 1
)

def Xform "pinch" (
    prepend apiSchemas = ["PhysicsArticulationRootAPI"]
)
{{
    def Xform "left" (
        prepend references = @{finger}@
        delete apiSchemas = ["PhysicsArticulationRootAPI"]
    )
    {{
        {left}
    }}
    def Xform "right" (
        prepend references = @{finger}@
        delete apiSchemas = ["PhysicsArticulationRootAPI"]
    )
    {{
        double3 xformOp:translate = {place}
        double3 xformOp:rotateXYZ = {turn}
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]

        over "scene" (
            active = false
        )
        {{
        }}
        over "distal_phalanx"
        {{
            over "tip" (
                active = false
            )
            {{
            }}
        }}
        {right}
    }}
}}
"""
"""Two of the nominal fingers."""
FACING = ((0.045, 0.001, -0.040), (0.0, 180.0, 0.0))
"""Place [m] and turn [deg] of a second finger that closes upwards against the first, in its plane
but for a millimetre."""
CROSSED = ((0.040, -0.022, -0.020), (0.0, 0.0, 90.0))
"""The same of one that lies across and below the first."""
Place = tuple[tuple[float, float, float], tuple[float, float, float]]


def write_pinch(folder: Path, place: Place = FACING, *, left: str = "", right: str = "") -> Path:
    """Write two fingers, with more in the prims of each, and return their file."""
    path = folder / "pinch.usda"
    where, turn = place
    finger = asset_path("finger").resolve()
    path.write_text(PINCH.format(finger=finger, place=where, turn=turn, left=left, right=right))
    return path


def pinch(folder: Path, place: Place = FACING) -> Mechanism:
    """Return two fingers."""
    return load_mechanism(write_pinch(folder, place))
