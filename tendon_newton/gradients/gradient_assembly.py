"""Makes the kernels of a rollout that can be walked back."""

from collections.abc import Generator
from contextlib import contextmanager
from functools import cache

import warp as wp

from tendon_newton.gradients import gradient_kernels, gradient_rules, substep_kernels
from tendon_newton.gradients.substep_chain import GRADIENT_BLOCK
from tendon_newton.simulation.dynamics.integrator import rosenbrock
from tendon_newton.simulation.dynamics.settling import frictionless_forces
from tendon_newton.simulation.model.assembly import Assembly, assemble
from tendon_newton.simulation.model.structure import Structure


@contextmanager
def copied_components() -> Generator[None]:
    """Let kernels that are made inside write vector components by copy.

    In place their adjoint is wrong.
    """
    before = wp.config.enable_vector_component_overwrites
    wp.config.enable_vector_component_overwrites = True
    try:
        yield
    finally:
        wp.config.enable_vector_component_overwrites = before


@cache
def gradient_kernel_set(structure: Structure) -> dict[str, wp.Kernel]:
    """Assemble the kernels that a tape walks back."""
    plain = assemble_with_rules(structure)
    # What runs once, or for few substeps, may run slowly: inlined it compiles four times longer.
    rare = assemble_with_rules(structure)
    for part in (rosenbrock, frictionless_forces):
        rare.specialiser.function(part, inline=False)
    table = {
        "start": (rare, gradient_kernels.start_kernel, True),
        "substep": (plain, substep_kernels.substep_kernel, False),
        "list": (plain, substep_kernels.list_kernel, False),
        "copy": (plain, substep_kernels.copy_kernel, False),
        "gather": (plain, substep_kernels.gather_kernel, False),
        "scatter": (plain, substep_kernels.scatter_kernel, False),
        "whole": (plain, substep_kernels.whole_kernel, True),
        "divided": (rare, substep_kernels.divided_kernel, True),
        "sense": (plain, gradient_kernels.taped_sense_kernel, True),
        "hold": (plain, gradient_kernels.taped_hold_kernel, True),
        "sweep": (plain, substep_kernels.sweep_kernel, False),
        "reading": (plain, gradient_kernels.reading_kernel, True),
    }
    with copied_components():
        return {
            name: assembly.kernel(template, enable_backward=taped, block_dim=GRADIENT_BLOCK)
            for name, (assembly, template, taped) in table.items()
        }


def assemble_with_rules(structure: Structure) -> Assembly:
    """Bind the device code of a structure with the derivatives that are written by hand."""
    assembly = assemble(structure, taped=True)
    meets = bool(structure.touch.contacts)
    gradient_rules.add_gradient_rules(assembly.specialiser, meets=meets)
    assembly.specialiser.gradient(gradient_kernels.gravity_slope, gradient_kernels.constant_slope)
    if structure.routes.spans:
        assembly.specialiser.gradient(
            gradient_kernels.guide_turning, gradient_kernels.constant_turning
        )
    if meets:
        assembly.specialiser.gradient(
            gradient_kernels.contact_turning, gradient_kernels.constant_slope
        )
    return assembly
