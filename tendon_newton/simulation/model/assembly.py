"""Kernels made to measure: for one mechanism, actuator, list of effects and precision."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from tendon_newton.actuators import find_actuator
from tendon_newton.data.recording import DrivenBy
from tendon_newton.device_code import placeholders, slots
from tendon_newton.device_code.linear_algebra import inverse, looped_inverse
from tendon_newton.device_code.structs import Joint, Tendon
from tendon_newton.device_code.templates import Bindings, Specialiser
from tendon_newton.effects import Effect, Stage
from tendon_newton.law.servo import duty_of_force, force_of_duty
from tendon_newton.simulation.chains import planar_chain, spatial_chain
from tendon_newton.simulation.contact import contact_distances, contact_poses, contacts, free_body
from tendon_newton.simulation.dynamics import (
    contact_states,
    events,
    forces,
    integrator,
    sensors,
    settling,
)
from tendon_newton.simulation.kernels import path_kernels, position_kernels, rollout_kernels
from tendon_newton.simulation.kernels.path_kernels import PATH_EFFECTS
from tendon_newton.simulation.kernels.position_kernels import POSITION_EFFECTS
from tendon_newton.simulation.model.kernel_types import kernel_types
from tendon_newton.simulation.model.stage_fields import check_stage
from tendon_newton.simulation.model.structure import JOINT_STAGES, Structure
from tendon_newton.simulation.tendons import measured_force, routes, stages

# Where each stage is called, and the template that applies its effects
STAGES: dict[Stage, tuple[Any, Any]] = {
    Stage.PERIOD: (slots.period_effects, stages.scalar_stage),
    Stage.CLOCK: (slots.clock_effects, stages.tendon_number_stage),
    Stage.RADIUS: (slots.radius_effects, stages.tendon_number_stage),
    Stage.STRING: (slots.string_effects, stages.tendon_number_stage),
    Stage.STRETCH: (slots.stretch_effects, stages.signal_stage),
    Stage.ANGLE: (slots.angle_effects, stages.signal_stage),
    Stage.ERROR: (slots.error_effects, stages.signal_stage),
    Stage.DUTY: (slots.duty_effects, stages.signal_stage),
    Stage.MOTOR_FORCE: (slots.motor_force_effects, stages.signal_stage),
    Stage.SPOOL_FORCE: (slots.spool_force_effects, stages.signal_stage),
    Stage.SLIDING: (slots.sliding_effects, stages.signal_stage),
    Stage.TENSION: (slots.tension_effects, stages.signal_stage),
    Stage.ENCODER: (slots.encoder_effects, stages.signal_stage),
    Stage.LINE: (slots.line_effects, stages.signal_stage),
    Stage.TRANSMISSION: (slots.transmission_effects, stages.signal_stage),
    Stage.SPEED: (slots.speed_effects, stages.tendon_number_stage),
    Stage.SPRING: (slots.spring_effects, stages.signal_stage),
    Stage.DAMPING: (slots.damping_effects, stages.signal_stage),
    Stage.JOINT_FRICTION: (slots.joint_friction_effects, stages.joint_number_stage),
    Stage.INERTIA: (slots.inertia_effects, stages.scalar_stage),
    Stage.TILT: (slots.tilt_effects, stages.scalar_stage),
    Stage.CELL_CLOCK: (slots.cell_clock_effects, stages.tendon_number_stage),
    Stage.CELL_LAG: (slots.cell_lag_effects, stages.tendon_number_stage),
    Stage.CELL: (slots.cell_effects, stages.timed_stage),
}
# Stages after which effects may renew what they remember
MEMORIES: dict[Stage, tuple[Any, Any]] = {
    Stage.ERROR: (slots.error_memory, stages.signal_memory),
    Stage.DUTY: (slots.duty_memory, stages.signal_memory),
    Stage.MOTOR_FORCE: (slots.motor_force_memory, stages.signal_memory),
    Stage.TENSION: (slots.tension_memory, stages.signal_memory),
    Stage.LINE: (slots.line_memory, stages.signal_memory),
    Stage.SPRING: (slots.spring_memory, stages.signal_memory),
}
# Where effects on an angle act where only positions are known, by their side: play lies before the
# shaft, the encoder's offset after
ANGLE_SIDES: dict[str, Any] = {"sensor": slots.offset_effects, "transmission": slots.play_effects}
# Parts of a string's path that fold to little where it is known which joints move them
ROUTE_PARTS = (
    routes.sign_of,
    routes.turn_sign,
    routes.end_moves,
    routes.end_turning,
    routes.span_bend,
    routes.span_route,
)
# More joints than this [1] are eliminated in loops; six take a compiler a quarter of a minute
UNROLLED_JOINTS = 6
# Where links may meet, kernels of more coordinates than this [1] call their parts: copied to where
# they are used, a CPU's compiler takes minutes over six
COPIED_COORDINATES = 4
# Loops longer than this [1] stay loops unless a kernel asks for more: Warp's own number
WARP_UNROLL = 16
CUDA_BLOCK = 256  # Threads of a block [1] on CUDA unless a launch says otherwise: Warp's own number
# With more effects than this [1] a kernel is one of a search, which runs it for minutes
MANY_EFFECTS = 20
# Compiler flags of such a kernel on a CPU: Warp's own, but what is called is nearly all inlined. A
# call copies 2 KB of a world. With one tendon whose arms are constant it takes 15 % less time to
# run, and 8 s more to compile. With two, or with routes, it would gain at most 4 % for 28 s.
# Without ``-march=native`` it is as fast and gives the same bits (docs/lab/start.md), and serves
# every x86-64 processor: so the wheel brings some such kernels.
INLINING_FLAGS = (
    "-mllvm=-inline-threshold=60000 -mllvm=-inline-cold-callsite-threshold=3000"
    " -mllvm=-slp-recursion-max-depth=4"
)
# Warp's own flags on a CPU without ``-march=native``, for kernels that the wheel brings too. One
# tendon with constant arms steps as fast with them; a hand with a ball takes a third longer.
PORTABLE_FLAGS = "-mllvm=-inline-threshold=9000 -mllvm=-inline-cold-callsite-threshold=3000"

# What a long kernel does seldom, and calls: so it compiles in half the time
RARE_PARTS = (
    integrator.divided_step,
    sensors.read_sensors,
    sensors.tensions,
    settling.frictionless_forces,
)
# What a kernel with a free body, or of a hand whose links meet, does in several places, and calls;
# what is called stands first. With these copied into one function a compiler for CUDA takes more
# than six minutes over a free body.
LONG_PARTS = (
    contact_states.constrained_solve,
    routes.located,
    forces.smooth_forces,
    contact_states.begin,
    events.bring_row,
    events.first_event,
    integrator.rosenbrock,
    events.bring_back,
)


@dataclass(frozen=True, kw_only=True)
class Assembly:
    """The device code of one structure, bound; kernels are made from it."""

    structure: Structure
    types: Bindings
    specialiser: Specialiser

    def kernel(
        self,
        template: Callable[..., None],
        *,
        enable_backward: bool = False,
        launch_bounds: tuple[int, int] | None = None,
        block_dim: int = CUDA_BLOCK,
        portable: bool = False,
    ) -> wp.Kernel:
        """Make a kernel; Warp compiles it at first launch and caches it.

        Args:
            template: Device code without a result.
            enable_backward: Whether a tape may walk it back, which takes longer to compile.
            launch_bounds: On CUDA, the threads of a block and the blocks that a multiprocessor
                must have room for; the registers of a thread follow.
            block_dim: On CUDA, the threads of a block when it is launched.
            portable: Whether it shall serve every x86-64 processor where that is as fast.
        """
        unroll = max(WARP_UNROLL, len(self.structure.routes.spans), self.structure.coordinate_count)
        options: dict[str, Any] = {"max_unroll": unroll, "block_dim": block_dim}
        if self.structure.precision == "float32":
            # on CUDA alone: divisions, roots and angles to some 1e-7, at half the instructions
            options["fast_math"] = True
        one_path = self.structure.tendon_count == 1 and not self.structure.routes.spans
        many = len(self.structure.effects) > MANY_EFFECTS
        if one_path and (many or portable) and not enable_backward:
            options["cpu_compiler_flags"] = INLINING_FLAGS if many else PORTABLE_FLAGS
        return self.specialiser.kernel(
            template,
            repr(self.structure),
            enable_backward=enable_backward,
            launch_bounds=launch_bounds,
            module_options=options,
        )


@dataclass(frozen=True, kw_only=True)
class KernelSet:
    """The kernels of a rollout, with the Warp types of their arguments."""

    structure: Structure
    types: Bindings
    settle: wp.Kernel
    rollout: wp.Kernel

    @property
    def launched(self) -> tuple[wp.Kernel, ...]:
        """The kernels that every rollout launches; what takes longest to compile stands first."""
        return self.rollout, self.settle


@cache
def kernel_set(structure: Structure) -> KernelSet:
    """Make the kernels of a rollout."""
    assembly = assemble(structure)
    settle, rollout = settling.settle_kernel, rollout_kernels.rollout_kernel
    if find_actuator(structure.actuator).kinematic:
        bind_position_stages(assembly.specialiser, structure)
        settle, rollout = position_kernels.start_kernel, position_kernels.position_kernel
        if structure.driven_by == "path":
            settle, rollout = path_kernels.start_kernel, path_kernels.path_kernel
    return KernelSet(
        structure=structure,
        types=assembly.types,
        settle=assembly.kernel(settle),
        rollout=assembly.kernel(rollout),
    )


def assemble(structure: Structure, *, taped: bool = False) -> Assembly:
    """Bind the device code of a structure.

    A tape may walk its kernels back.
    """
    types = kernel_types(structure)
    # What is called would copy a world. Other kernels are inlined: there references cost a finger
    # 5 to 15 % on an H200.
    specialiser = Specialiser(types, references=calls_parts(structure) and not taped)
    specialiser.bind(placeholders.TAPED, taped)
    specialiser.bind(placeholders.SKIPS, bool(structure.effects) and not taped)
    if structure.coordinate_count > UNROLLED_JOINTS:
        specialiser.bind(inverse, specialiser.function(looped_inverse))
    bind_stages(specialiser, structure, taped=taped)
    actuator = find_actuator(structure.actuator)
    specialiser.bind(slots.actuator_force, actuator.force)
    specialiser.bind(slots.armature, actuator.armature)
    specialiser.bind(slots.motor_current, actuator.current)
    if structure.driven_by == "force":
        specialiser.bind(slots.actuator_force, measured_force.true_tension)
        specialiser.bind(slots.armature, measured_force.no_armature)
        specialiser.bind(slots.clock_effects, measured_force.reading_instant)
    bind_duty(specialiser, structure)
    chain = planar_chain if structure.planar else spatial_chain
    specialiser.bind(slots.chain_terms, chain.chain_terms)
    if structure.routes.spans:
        bind_routes(specialiser, looped=taped or is_long(structure))
    if structure.touch.contacts:
        if "box" in structure.touch.shapes:  # long: it halves a capsule's axis
            specialiser.function(contact_distances.overlap_at, inline=False)
        for part in (contacts.grip_of, contacts.grip_terms):
            specialiser.function(part, inline=False)
        pose = contact_poses.planar_pose if structure.planar else contact_poses.spatial_pose
        specialiser.bind(slots.contact_pose, pose)
        specialiser.bind(slots.contact_terms, contacts.contact_terms)
        specialiser.bind(slots.contact_memory, contacts.contact_memory)
        specialiser.bind(slots.with_body_terms, free_body.with_body_terms)
        specialiser.bind(slots.with_still_body, free_body.with_still_body)
    if not taped:
        call_parts(specialiser, structure)
    return Assembly(structure=structure, types=types, specialiser=specialiser)


def is_long(structure: Structure) -> bool:
    """Tell whether kernels are long: with a free body, or of a hand whose links may meet."""
    touch = structure.touch
    return touch.moves or (bool(touch.pairs) and structure.coordinate_count > COPIED_COORDINATES)


def calls_parts(structure: Structure) -> bool:
    """Tell whether kernels call what they do seldom: with long parts, routes or many effects."""
    many = len(structure.effects) > MANY_EFFECTS
    return many or is_long(structure) or bool(structure.routes.spans)


def call_parts(specialiser: Specialiser, structure: Structure) -> None:
    """Choose what kernels without an adjoint call, and what is copied to where it is used."""
    long = is_long(structure)
    called = LONG_PARTS if long else ()
    if calls_parts(structure):
        called += RARE_PARTS
    for part in called:
        specialiser.function(part, inline=False)
    # a call would copy 2 KB of a world; inlined, what a world keeps is read once
    specialiser.function(integrator.step, inline=not long)


def bind_duty(specialiser: Specialiser, structure: Structure) -> None:
    """Bind what a servo gives as a share of all that it has: a motor's duty, else its force."""
    actuator = find_actuator(structure.actuator)
    asked, given = duty_of_force, force_of_duty
    if structure.driven_by == "command" and actuator.modulated:
        asked, given = actuator.duty, actuator.driven
    specialiser.bind(slots.asked_duty, asked)
    specialiser.bind(slots.driven_force, given)


def bind_routes(specialiser: Specialiser, *, looped: bool) -> None:
    """Bind the paths of routed tendons: quick to run, or quick to compile.

    A compiler would take many minutes over an adjoint, or over the coordinates of a free body or of
    a hand.
    """
    if looped:
        specialiser.bind(slots.all_routes, routes.looped_routes)
        return
    for part in ROUTE_PARTS:
        specialiser.function(part, inline=True)
    # long, and used in several places: copied there, a compiler for CUDA takes minutes
    specialiser.bind(slots.all_routes, specialiser.function(routes.unrolled_routes, inline=False))


def bind_stages(specialiser: Specialiser, structure: Structure, *, taped: bool) -> None:
    """Bind the device functions of each stage: what acts in it, and what is remembered after it."""
    # an adjoint would take minutes to compile, and without effects there is nothing to save
    inline = True if structure.effects and not taped else None
    effects = able_effects(structure)
    for stage, (slot, template) in STAGES.items():
        hooks = [(effect.name, structure.hook(effect, stage)) for effect in effects]
        acting = [(name, hook) for name, hook in hooks if hook]
        for _, hook in acting:
            check_stage(hook, stage)
        owner = Joint if stage in JOINT_STAGES else Tendon
        function = stage_function(specialiser, template, acting, structure, owner, inline=inline)
        specialiser.bind(slot, function)
    for stage, (slot, template) in MEMORIES.items():
        keepers = [e for e in effects if e.memory is stage and structure.remembers(e)]
        keeping = [(e.name, renewal) for e in keepers for renewal in e.renewals()]
        for _, renewal in keeping:
            check_stage(renewal, None)
        places = [place for e in keepers for place in structure.memories[e.name]]
        owner = Joint if stage in JOINT_STAGES else Tendon
        function = stage_function(
            specialiser, template, keeping, structure, owner, places, inline=inline
        )
        specialiser.bind(slot, function)


def able_effects(structure: Structure) -> list[type[Effect]]:
    """Return the effects that can act: on a position or a path, only those that are about one.

    Others share its stages, and even at null may read what is not filled there.
    """
    if not find_actuator(structure.actuator).kinematic:
        return list(structure.declarations)
    acting = kinematic_effects(structure.driven_by)
    return [e for e in structure.declarations if e.name in acting]


def kinematic_effects(driven_by: DrivenBy) -> tuple[str, ...]:
    """Return the effects that can act where an actuator moves its shaft whatever that carries."""
    return PATH_EFFECTS if driven_by == "path" else POSITION_EFFECTS


def bind_position_stages(specialiser: Specialiser, structure: Structure) -> None:
    """Bind what acts on an angle apart, by its side."""
    hooks = [(e.name, e.side, e.hook(Stage.ANGLE)) for e in able_effects(structure)]
    for side, slot in ANGLE_SIDES.items():
        acting = [(effect, hook) for effect, of, hook in hooks if of == side and hook]
        function = stage_function(specialiser, stages.signal_stage, acting, structure)
        specialiser.bind(slot, function)


def stage_function(
    specialiser: Specialiser,
    template: Any,
    hooks: list[tuple[str, Any]],
    structure: Structure,
    owner: type = Tendon,
    places: Sequence[int] = (),
    *,
    inline: bool | None = True,
) -> Any:
    """Bind a stage's template to the device functions of some effects.

    Hooks are device functions with the names of their effects, about an owner's struct; the result
    of each goes to its place in a world's memory, if it is remembered. It is inlined whatever its
    length: a call copies all of a world's numbers.
    """
    child = specialiser.child()
    child.bind(placeholders.Owner, kernel_types(structure)[owner])
    child.bind(placeholders.FUNCTIONS, tuple(child.function(hook) for _, hook in hooks))
    child.bind(placeholders.OFFSETS, tuple(structure.offsets[name] for name, _ in hooks))
    child.bind(placeholders.STRIDES, tuple(structure.stride(name) for name, _ in hooks))
    own = [(*structure.memories.get(name, ()), -1, -1) for name, _ in hooks]
    child.bind(placeholders.MEMORIES, tuple(first for first, *_ in own))
    child.bind(placeholders.SECOND_MEMORIES, tuple(second for _, second, *_ in own))
    child.bind(placeholders.PLACES, tuple(places))
    child.bind(placeholders.BITS, tuple(structure.effects.index(name) for name, _ in hooks))
    return child.function(template, inline=inline)
