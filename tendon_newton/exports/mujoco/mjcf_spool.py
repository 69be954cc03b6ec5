"""A spool of its own for a string in MJCF: its motor turns freely where the string is loose.

MuJoCo's actuators push at a tendon as well as they pull, and a rotor at a tendon drags the
mechanism along. So the rotor is a joint of its own, and the string a tendon of limited length that
runs over it: a limit only pulls.
"""

from typing import Any

import numpy as np

from tendon_newton.data.channels import TURNS
from tendon_newton.mechanisms.authoring.mujoco_file import newton_s_mujoco
from tendon_newton.mechanisms.geometry.parts import Tendon

# MuJoCo's `solref` and `solimp` of a string: two steps, and as rigid as leaves its force quiet
TAUT_TIME = 1.0e-3  # [s]
TAUT_SHAPE = (0.99, 0.99, 1.0e-3, 0.5, 2.0)
LEAST_MASS = 1.0e-6  # Of the body that carries a rotor [kg], whose inertia is the joint's
HIDDEN = 5  # Group of sites that no viewer shows unasked


def spool_name(tendon: str) -> str:
    """Return the name of a spool: of its joint, whose place is what is wound in, and its tendon."""
    return f"{tendon}_spool"


def tension_name(tendon: str) -> str:
    """Return the name of the sensor that shows a string's tension [N]."""
    return f"{tendon}_tension"


def add_spool(spec: Any, tendon: Tendon, radius: float, inertia: float, taut_at: float) -> None:
    """Add the spool of a string, with a sensor of its tension.

    An actuator finds a tendon over the spool's joint: MuJoCo weighs the dry friction of a tendon by
    the rotor, and that of a joint by its body alone, at which it would creep.

    Args:
        spec: MuJoCo's editable model, which holds the tendon.
        tendon: The tendon that the string runs along.
        radius: Of the spool [m].
        inertia: Of its rotor [kg m2].
        taut_at: Motor angle [rad] at which the string is taut where the tendon has no length.
    """
    kinds = newton_s_mujoco()
    loose = TURNS * radius  # as far as any log's angle may go
    own = spec.tendon(tendon.name)
    string = spec.add_tendon(name=f"{tendon.name}_string")
    if tendon.route is None:
        body, slack = spec.worldbody.add_body(name=spool_name(tendon.name)), 0.0
        for wrap in own.path:
            string.wrap_joint(wrap.target.name, -wrap.coef)
        string.wrap_joint(spool_name(tendon.name), 1.0)
    else:
        first, slack = own.path[0].target, loose
        body = first.parent.add_body(name=spool_name(tendon.name), pos=first.pos)
        body.add_site(name=spool_name(tendon.name), pos=[-loose, 0.0, 0.0], group=HIDDEN)
        string.wrap_site(spool_name(tendon.name))
        for wrap in own.path:
            if wrap.type == kinds.mjtWrap.mjWRAP_SITE:
                string.wrap_site(wrap.target.name)
            else:
                string.wrap_geom(wrap.target.name, wrap.sidesite.name if wrap.sidesite else "")
    body.mass, body.inertia = LEAST_MASS, np.full(3, LEAST_MASS * radius**2)
    body.ipos = np.zeros(3)
    body.explicitinertial = True
    string.limited, string.range = True, [-1.0e3, slack + radius * taut_at]
    string.solref_limit, string.solimp_limit = (TAUT_TIME, 1.0), TAUT_SHAPE
    string.rgba[3] = 0.0
    spec.add_sensor(
        name=tension_name(tendon.name), type=kinds.mjtSensor.mjSENS_TENDONLIMITFRC,
        objtype=kinds.mjtObj.mjOBJ_TENDON, objname=string.name,
    )  # fmt: skip
    body.add_joint(
        name=spool_name(tendon.name), type=kinds.mjtJoint.mjJNT_SLIDE, axis=[-1.0, 0.0, 0.0],
        armature=inertia / radius**2, limited=True, range=[-loose, loose],
    )  # fmt: skip
    spec.add_tendon(name=spool_name(tendon.name)).wrap_joint(spool_name(tendon.name), 1.0)
