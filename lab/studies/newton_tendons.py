"""How near Newton's own tendons come to a weight on each end of a string over a fixed pulley.

    python -m lab.studies.newton_tendons

The string wraps by half a turn, so that the answer is known: a = g (M - m k) / (M + m k), with
k = exp(pi mu) between both tensions (Euler-Eytelwein). Newton's solvers run on one core.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import newton
import numpy as np
import warp as wp

from tendon_newton.device_code.quiet import quiet_warp

HEAVY, LIGHT, GRAVITY, RADIUS = 0.3, 0.2, 9.81, 0.02
HEIGHT = 0.3  # Of the pulley over both weights [m]
DURATION = 0.2
FRICTIONS = (0.0, 0.05, 0.1)
STEPS = (1.0e-3, 2.5e-4)
ITERATIONS = 16
STIFFNESS = 1.0e5  # Of each half of the string [N/m]: it stretches by 0.03 mm
SOLVERS: dict[str, Callable[..., Any]] = {
    "SolverXPBD": newton.solvers.SolverXPBD,
    "SolverVBD": newton.solvers.SolverVBD,
}


def pulley(friction: float) -> Any:
    """Return a model of two weights on vertical rails, with the light one first."""
    builder = newton.ModelBuilder(up_axis=newton.Axis.Z, gravity=(0.0, 0.0, -GRAVITY))
    rail = newton.ModelBuilder.JointDofConfig(axis=newton.Axis.Z)
    weights = []
    for side, mass in ((-1.0, LIGHT), (1.0, HEAVY)):
        place = wp.transform(p=wp.vec3(side * RADIUS, 0.0, -HEIGHT), q=wp.quat_identity())
        inertia = wp.mat33(np.eye(3) * 1.0e-4)
        body = builder.add_link(xform=place, mass=mass, inertia=inertia, lock_inertia=True)
        joint = builder.add_joint_d6(
            parent=-1, child=body, linear_axes=[rail], angular_axes=[], parent_xform=place
        )
        builder.add_articulation([joint])
        weights.append(body)
    span = {"compliance": 1.0 / STIFFNESS, "axis": (0.0, 1.0, 0.0)}
    kinds = newton.TendonGuideType
    builder.add_tendon(
        [
            newton.TendonGuide(body=weights[0], guide_type=kinds.ANCHOR, axis=span["axis"]),
            newton.TendonGuide(
                body=-1, guide_type=kinds.ROLLER, radius=RADIUS, mu=friction, **span
            ),
            newton.TendonGuide(body=weights[1], guide_type=kinds.ANCHOR, **span),
        ]
    )
    builder.color()
    return builder.finalize(device="cpu")


def fallen(solver: str, friction: float, step: float) -> tuple[float, float]:
    """Return how far the heavy weight has fallen [m], and what a step takes [s]."""
    model = pulley(friction)
    engine = SOLVERS[solver](model, iterations=ITERATIONS)
    one, other = model.state(), model.state()
    control = model.control()
    engine.step(model.state(), other, control, None, step)  # compiles
    engine = SOLVERS[solver](model, iterations=ITERATIONS)
    with wp.ScopedCapture(device=model.device) as capture:
        engine.step(one, other, control, None, step)
        engine.step(other, one, control, None, step)
    pairs = round(0.5 * DURATION / step)
    start = time.perf_counter()
    for _ in range(pairs):
        assert capture.graph is not None
        wp.capture_launch(capture.graph)
    taken = (time.perf_counter() - start) / (2 * pairs)
    return -HEIGHT - float(one.body_q.numpy()[1, 2]), taken


def known(friction: float) -> float:
    """Return how far it falls [m] by the capstan equation."""
    ratio = LIGHT * math.exp(math.pi * friction)
    return 0.5 * GRAVITY * (HEAVY - ratio) / (HEAVY + ratio) * DURATION**2


def main() -> None:
    """Print a table."""
    quiet_warp()
    print("| solver | mu | step | fallen | by the equation | a step takes |")
    print("|---|---|---|---|---|---|")
    for solver in SOLVERS:
        for friction in FRICTIONS:
            for step in STEPS:
                way, taken = fallen(solver, friction, step)
                print(
                    f"| {solver} | {friction:g} | {1e3 * step:g} ms | {1e3 * way:.2f} mm "
                    f"| {1e3 * known(friction):.2f} mm | {1e3 * taken:.2f} ms |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
