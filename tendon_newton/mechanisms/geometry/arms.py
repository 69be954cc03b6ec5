"""An arm between a joint and the load that its link stands for: an even rod, by its mass.

A weight on an arm is often all that is stated of a pendulum. The arm adds half its mass to the
moment of gravity and a third to the inertia about the joint. Masses m [kg] have shape (...),
centres c from the joint [m] (..., D) and inertias about c [kg m^2] (...) in a plane, (..., 3, 3) in
space.

Source: the parallel axis theorem; a rod's inertia about its middle is a l^2 / 12.
"""

import numpy as np

from tendon_newton.data.recording import Array

Body = tuple[Array, Array, Array]  # Mass, centre and inertia about the centre


def with_arm(load: Body, arm: Array) -> Body:
    """Return a load and the arm that carries it as one body."""
    mass, centre, inertia = load
    whole = mass + arm
    share = (mass + 0.5 * arm) / whole
    return whole, share[..., None] * centre, inertia + added(mass, arm, share, centre, inertia)


def without_arm(body: Body, arm: Array) -> Body:
    """Return the load alone of a body that `with_arm` made."""
    whole, centre, inertia = body
    mass = whole - arm
    share = (mass + 0.5 * arm) / whole
    end = centre / share[..., None]
    return mass, end, inertia - added(mass, arm, share, end, inertia)


def added(mass: Array, arm: Array, share: Array, end: Array, inertia: Array) -> Array:
    """Return what an arm that ends at the load adds to the inertia about the common centre."""
    moment = mass * (1.0 - share) ** 2 + arm * (1.0 / 12.0 + (0.5 - share) ** 2)
    square = (end**2).sum(axis=-1)
    if inertia.ndim == mass.ndim:
        return moment * square
    outer = end[..., :, None] * end[..., None, :]
    return moment[..., None, None] * (square[..., None, None] * np.eye(3) - outer)
