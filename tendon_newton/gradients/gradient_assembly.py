"""Makes the kernels of a rollout that can be walked back."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import struct_type
from tendon_newton.gradients import gradient_kernels, gradient_rules, substep_kernels
from tendon_newton.simulation.dynamics.integrator import rosenbrock
from tendon_newton.simulation.dynamics.settling import frictionless_forces
from tendon_newton.simulation.model.assembly import Assembly, assemble
from tendon_newton.simulation.model.kernel_types import kernel_types
from tendon_newton.simulation.model.structure import Structure


@contextmanager
def copied_components() -> Iterator[None]:
    """Let kernels that are compiled inside write vector components by copy.

    In place their adjoint is wrong.
    """
    before = wp.config.enable_vector_component_overwrites
    wp.config.enable_vector_component_overwrites = True
    try:
        yield
    finally:
        wp.config.enable_vector_component_overwrites = before


@cache
def gradient_kernel_set(
    structure: Structure, inline: bool = False
) -> tuple[dict[str, wp.Kernel], dict[str, Any]]:
    """Assemble the kernels that a tape walks back, with the Warp types of their arguments.

    Args:
        structure: What decides their code.
        inline: Whether the substep's functions are inlined.
    """
    types = kernel_types(structure)
    grid = wp.array(dtype=types["real"], ndim=2)
    schedule = {
        "time": grid,
        "duration": grid,
        "row": wp.array(dtype=wp.int32, ndim=2),
        "plan": wp.array(dtype=wp.int32),
    }
    types = {
        **types,
        "Schedule": struct_type("Schedule", schedule),
        "REMEMBERED": structure.memory_count,
    }
    plain = assemble_with_rules(structure, types, inline=False)
    substep = assemble_with_rules(structure, types, inline=True) if inline else plain
    # What runs once, or for few substeps, may run slowly: inlined it compiles four times longer.
    rare = assemble_with_rules(structure, types, inline=False)
    for part in (rosenbrock, frictionless_forces):
        rare.specialiser.function(part, inline=False)
    kernels = {
        "start": rare.kernel(gradient_kernels.start_kernel, enable_backward=True),
        "substep": substep.kernel(substep_kernels.substep_kernel),
        "list": plain.kernel(substep_kernels.list_kernel),
        "copy": plain.kernel(substep_kernels.copy_kernel),
        "gather": plain.kernel(substep_kernels.gather_kernel),
        "scatter": plain.kernel(substep_kernels.scatter_kernel),
        "whole": substep.kernel(substep_kernels.whole_kernel, enable_backward=True),
        "divided": rare.kernel(substep_kernels.divided_kernel, enable_backward=True),
        "sweep": plain.kernel(substep_kernels.sweep_kernel),
        "reading": plain.kernel(gradient_kernels.reading_kernel, enable_backward=True),
    }
    return kernels, types


def assemble_with_rules(structure: Structure, types: dict[str, Any], *, inline: bool) -> Assembly:
    """Bind the device code of a structure with the derivatives that are written by hand."""
    assembly = assemble(structure, types, inline=inline, taped=True)
    gradient_rules.add_gradient_rules(assembly.specialiser)
    assembly.specialiser.gradient(gradient_kernels.gravity_slope, gradient_kernels.constant_slope)
    if structure.routes.spans:
        assembly.specialiser.gradient(
            gradient_kernels.guide_turning, gradient_kernels.constant_turning
        )
    if structure.touch.contacts:
        gradient_rules.add_contact_rules(assembly.specialiser)
        assembly.specialiser.gradient(
            gradient_kernels.contact_turning, gradient_kernels.constant_slope
        )
    return assembly
