"""The structs of the device code: what kernels pass around, with units and meaning.

Each class is declared once, here. A type checker reads it as it stands; a `Specialiser` makes a
Warp struct of it for the mechanism at hand. A field that is ``Annotated`` with a constant is there
only where that constant is true.
"""

from __future__ import annotations

from typing import Annotated

import warp as wp

from tendon_newton.device_code.placeholders import (
    HAS_BODY,
    HAS_LOAD,
    LED,
    PLANAR,
    ROUTED,
    SHARES_BODY,
    TOUCHES,
    ArmMatrix,
    BendMatrix,
    CapsuleMatrix,
    DeviceArray,
    DeviceBlock,
    DeviceGrid,
    Flags,
    Jet,
    JointMatrix,
    JointVector,
    LinkInertia,
    LinkMatrix,
    Mat33,
    MemoryVector,
    ParameterVector,
    Place,
    Quaternion,
    RowMatrix,
    RowVector,
    SpaceMatrix,
    TendonRows,
    TendonVector,
    TurnMatrix,
    Vec3,
    real,
)
from tendon_newton.device_code.templates import device_struct

# --- what effects see


@device_struct
class Tendon:
    """One tendon as an actuator and the effects along it see it."""

    index: int  # Which tendon of its world
    asleep: Flags  # See `Drive`
    time: real  # Instant [s] of the simulation
    elapsed: real  # Time [s] since the memory was current
    memory: MemoryVector  # What the world remembered then; an effect's own number is `values[3]`
    voltage: real  # Supply [V]; 0 stands for the actuator's own
    enabled: real  # Whether the servo gives torque (1) or hangs loose (0)
    # What was decided at the start of a step: 0 nothing, 1 the string is taut, 2 it is slack
    slack: real
    force_limit: real  # Greatest force of the servo, pulling or pushing [N]
    carried: real  # What the gear of a shaft carries [N]; 0 where that is not known
    least_tension: real  # Least tension [N]: 0 for a string, which cannot push
    command: real  # Angle asked for [rad], or what was measured [N] where no command is known
    error: real  # Command less the angle that the servo acts on [rad]
    motor_force: Jet  # What the motor gives before friction [N]
    tension: real  # Tension at the load cell [N]
    nominal_radius: real  # The asset's spool radius [m]
    spool_radius: real  # The spool's radius with its effects [m]
    inverse_radius: real  # Inverse of that radius [1/m]
    length: real  # Excursion l of the mechanism [m]
    string: real  # Stiffness of a string that pulls on a spool of its own [N/m]; else 0
    rate: real  # Rate of the excursion [m/s]
    # String on the spool [m]: the excursion, and by how much a spool of its own leads it
    wound: real
    velocity: real  # Rate of the wound string [m/s]
    acceleration: real  # Mean acceleration of the wound string since the memory was current [m/s2]
    # +1 while it slides in, -1 while it slides out, +2 and -2 beyond the motor's speed, 0 without
    # friction
    side: real
    direction: real  # The side within -1 and +1
    angle_rate: Jet  # Rate of the shaft [rad/s]


@device_struct
class Joint:
    """One joint as the effects at it see it."""

    index: int  # Which joint of its world
    asleep: Flags  # See `Drive`
    elapsed: real  # Time [s] since the memory was current
    memory: MemoryVector  # What the world remembered then; an effect's own number is `values[3]`
    position: real  # [rad] or [m]
    velocity: real  # [rad/s] or [m/s]
    stiffness: real  # Stiffness of its return spring [N m/rad] or [N/m]
    rest: real  # Where that spring is relaxed [rad, m]
    damping: real  # Viscous damping [N m s/rad] or [N s/m]
    lower: real  # Where its lower end stop is met [rad, m]
    upper: real  # Where its upper end stop is met [rad, m]


# --- what kernels read


@device_struct
class Mechanism:
    """Numbers of all benches of a launch."""

    stiffness: DeviceArray[JointVector]  # Stiffness of the return springs [N m/rad] or [N/m]
    rest: DeviceArray[JointVector]  # Where they are relaxed [rad, m]
    damping: DeviceArray[JointVector]  # Viscous damping [N m s/rad] or [N s/m]
    friction: DeviceArray[JointVector]  # Dry friction of the joints [N m] or [N]
    armature: DeviceArray[JointVector]  # Inertia that turns with a joint's axis [kg m2] or [kg]
    lower: DeviceArray[JointVector]  # Lower end stops [rad, m]
    upper: DeviceArray[JointVector]  # Upper end stops [rad, m]
    limit_stiffness: DeviceArray[JointVector]  # Stiffness of the end stops [N m/rad] or [N/m]
    limit_damping: DeviceArray[JointVector]  # Damping of the end stops [N m s/rad] or [N s/m]
    excursion_offset: DeviceArray[TendonVector]  # Excursions at q = 0 [m]
    spool_radius: DeviceArray[TendonVector]  # [m]; 1 for a shaft that turns its joint directly
    force_limit: DeviceArray[TendonVector]  # Greatest forces of the servos [N]
    least_tension: DeviceArray[TendonVector]  # Least tensions [N]: 0 for a string
    offset: DeviceGrid[Place]  # Place of each joint in its parent's frame [m]
    centre: DeviceGrid[Place]  # Centre of mass of each link in its own frame [m]
    axis: DeviceGrid[Place]  # Unit vector along which, or about which, each joint moves [1]
    gravity: DeviceArray[Place]  # Gravity in the axes of the base [m/s2]
    # What tipping the bench takes from it by the sine of the angle [m/s2]
    gravity_across: DeviceArray[Place]
    # What tipping takes from it by one less the cosine of the angle [m/s2]
    gravity_along: DeviceArray[Place]
    arms: DeviceArray[ArmMatrix]  # Moment arms that are constant [m] or [1]
    mass: DeviceGrid[real]  # Masses of the links [kg]
    inertia: DeviceGrid[LinkInertia]  # Inertias of the links about their centres of mass [kg m2]
    # Points of the tendons' paths in the frames of their links [m]
    path_point: Annotated[DeviceGrid[Vec3], ROUTED]
    # Axes of the pulleys in these frames, as columns [1]
    path_frame: Annotated[DeviceGrid[Mat33], ROUTED]
    path_radius: Annotated[DeviceGrid[real], ROUTED]  # Radii of the pulleys [m], 0 for a site
    # +1 or -1: sense in which a string goes around its pulley
    path_turn: Annotated[DeviceGrid[real], ROUTED]
    obstacle_position: Annotated[DeviceGrid[Vec3], TOUCHES]  # [m], in the axes of the base
    # Axes of the obstacles, as columns [1]
    obstacle_rotation: Annotated[DeviceGrid[Mat33], TOUCHES]
    # Radius of a sphere or half sides of a box [m]
    obstacle_size: Annotated[DeviceGrid[Vec3], TOUCHES]
    # [N/m]; 0 where there is no such obstacle
    obstacle_stiffness: Annotated[DeviceGrid[real], TOUCHES]
    # Damping as a share of the elastic force [s/m]
    obstacle_dissipation: Annotated[DeviceGrid[real], TOUCHES]
    obstacle_friction: Annotated[DeviceGrid[real], TOUCHES]  # Coefficients of dry friction [1]
    # Where the capsules' axes begin, in the frames of their links [m]
    capsule_start: Annotated[DeviceGrid[Vec3], TOUCHES]
    capsule_end: Annotated[DeviceGrid[Vec3], TOUCHES]  # Where they end [m]
    capsule_radius: Annotated[DeviceGrid[real], TOUCHES]  # [m]
    # The plane of motion and its normal as rows [1]
    contact_plane: Annotated[DeviceArray[Mat33], TOUCHES, PLANAR]
    body_mass: Annotated[DeviceArray[real], HAS_BODY]  # Mass of the free body [kg]
    # Inertia of the free body about its own axes [kg m2]
    body_inertia: Annotated[DeviceArray[Vec3], HAS_BODY]
    # Gravity in the axes of the base, out of a chain's plane too [m/s2]
    body_gravity: Annotated[DeviceArray[Vec3], HAS_BODY]


@device_struct
class Commands:
    """What was asked of the servos, recording after recording."""

    first: DeviceArray[int]  # First row of each recording
    count: DeviceArray[int]  # Number of rows of each recording
    time: DeviceArray[real]  # Instants of all rows on the log's clock [s]
    # Angles asked for from each row on [rad], angles or forces measured [N]
    angle: DeviceArray[TendonVector]
    # Torque on the joint from outside [N m], positive the way its angle grows
    load: Annotated[DeviceArray[real], HAS_LOAD]
    rate: Annotated[DeviceArray[real], LED]  # Rate of a shaft that is led [rad/s]
    acceleration: Annotated[DeviceArray[real], LED]  # Its acceleration [rad/s2]
    voltage: DeviceArray[real]  # Supply [V]; 0 stands for the actuator's own
    enabled: DeviceArray[real]  # Whether the servos give torque (1) or hang loose (0)
    start: DeviceArray[int]  # Where each recording starts: see `simulation.dynamics.settling`
    start_angle: DeviceArray[TendonVector]  # Shaft angles in the first row [rad]
    start_rate: DeviceArray[TendonVector]  # Rates of the shafts in the first row [rad/s]


@device_struct
class Worlds:
    """What tells the worlds of a launch apart."""

    mechanism: DeviceArray[int]  # Whose numbers each world has
    recording: DeviceArray[int]  # Which recording it replays
    parameters: DeviceArray[ParameterVector]  # Numbers of actuator and effects


@device_struct
class Rows:
    """The rows through which a launch takes worlds."""

    begin: DeviceArray[int]  # First row of each recording
    end: DeviceArray[int]  # The one behind its last
    out: DeviceArray[int]  # Where the first row of each world's recording stands in a readout


@device_struct
class Samples:
    """What force networks have seen of all servos; see `actuators.networks.history`."""

    ring: DeviceBlock[wp.float32]  # Samples, shape (H, 3, N)
    newest: DeviceArray[int]  # Place of each servo's newest sample in the ring, shape (N,)


@device_struct
class States:
    """The state of every world, carried on from launch to launch."""

    q: DeviceArray[JointVector]  # Coordinates [rad, m]
    v: DeviceArray[JointVector]  # Rates of the coordinates [rad/s, m/s]
    memory: DeviceArray[MemoryVector]  # What the worlds remember


@device_struct
class StateRows:
    """States of every world one after the other, shape (K, W)."""

    q: DeviceGrid[JointVector]  # Coordinates [rad, m]
    v: DeviceGrid[JointVector]  # Rates of the coordinates [rad/s, m/s]
    memory: DeviceGrid[MemoryVector]  # What the worlds remember


@device_struct
class Readout:
    """What is read in every row."""

    joint_position: DeviceArray[JointVector]  # [rad] or [m]
    motor_position: DeviceArray[TendonVector]  # What the encoders report [rad]
    motor_velocity: DeviceArray[TendonVector]  # Rates of these angles [rad/s]
    force: DeviceArray[TendonVector]  # What the load cells report [N]
    current: DeviceArray[TendonVector]  # Currents of the motors [A]; 0 where none is known


@device_struct
class Servo:
    """What a solver keeps of each world between control steps."""

    parameters: DeviceArray[ParameterVector]  # Numbers of actuator and effects
    time: DeviceArray[real]  # Instant [s] since the last reset
    q: DeviceArray[JointVector]  # Coordinates [rad, m], with more digits than Newton's
    v: DeviceArray[JointVector]  # Rates of the coordinates [rad/s, m/s]
    memory: DeviceArray[MemoryVector]  # What the worlds remember
    voltage: DeviceArray[wp.float32]  # Supply [V]; 0 stands for the actuator's own
    enabled: DeviceArray[wp.float32]  # Whether the servos give torque (1) or hang loose (0)
    command: DeviceGrid[wp.float32]  # Motor angles asked for [rad]
    position_index: DeviceGrid[int]  # Where a world's joints stand among Newton's positions
    velocity_index: DeviceGrid[int]  # Where they stand among its velocities
    # Where the free body is [m]; `v` has its speeds
    body_place: Annotated[DeviceArray[Vec3], HAS_BODY]
    body_turn: Annotated[DeviceArray[Quaternion], HAS_BODY]  # How it is turned
    # Mean force [N] and torque [N m] of each chain on it in the last step, shape (W K, 2)
    body_push: Annotated[DeviceGrid[Vec3], SHARES_BODY]
    # Where its seven coordinates begin among Newton's positions
    body_position_index: Annotated[DeviceArray[int], HAS_BODY]
    # Where its six speeds begin among Newton's velocities
    body_velocity_index: Annotated[DeviceArray[int], HAS_BODY]


@device_struct
class NewtonJoints:
    """The joints of all worlds in a state of Newton's."""

    position: DeviceArray[wp.float32]  # [rad] or [m]
    velocity: DeviceArray[wp.float32]  # [rad/s] or [m/s]


@device_struct
class Schedule:
    """The substeps of a differentiable rollout, shape (K, plans)."""

    time: DeviceGrid[real]  # When each begins on the log's clock [s]
    duration: DeviceGrid[real]  # How long it is [s]; 0 where a plan has ended
    row: DeviceGrid[int]  # Row of the recording to which it belongs
    plan: DeviceArray[int]  # Each world's plan


@device_struct
class ReadRows:
    """The rows that are read in a segment."""

    row: DeviceArray[int]  # Which each is, among those of all recordings
    world: DeviceArray[int]  # World of each row
    state: DeviceArray[int]  # Row of the states in which it is read


@device_struct
class Query:
    """One query of a force network in a differentiable rollout."""

    index: int  # Which of all queries
    slot: int  # Row of the states in which it happens; the next one holds its answer
    row: DeviceGrid[int]  # Row of each recording in each query, shape (Q, W)


@device_struct
class Marks:
    """What is noted of the substeps of a segment, shape (K, W)."""

    # Whether an event has divided a substep; then its slot in a list, counted from one
    divided: DeviceGrid[int]
    contact: DeviceGrid[ContactStates]  # The contact states in which each began
    count: DeviceArray[int]  # Number of divided substeps, shape (1,)


@device_struct
class Span:
    """Which substeps a launch walks back over."""

    substep: int  # The first among all
    at: int  # The first among those of its segment
    before: int  # Row of its beginning among the states
    after: int  # Row of its end among the states that follow
    follows: int  # Whether divided substeps follow slopes that are known (1)


@device_struct
class DividedSubsteps:
    """A list of the substeps that an event has divided."""

    count: DeviceArray[int]  # How many there are, shape (1,)
    place: DeviceArray[int]  # Which each is: k W + i for substep k of world i


@device_struct
class Slopes:
    """Derivatives of a substep's end by its beginning, per component of the state and substep."""

    q: DeviceBlock[JointVector]  # By the coordinates, shape (2 J + S, K, W)
    v: DeviceBlock[JointVector]  # By their rates
    memory: DeviceBlock[MemoryVector]  # By what the worlds remember


# --- what lives inside kernels


@device_struct
class Log:
    """A recording among those of a launch."""

    first: int  # First row of the recording among the commands
    count: int  # Number of rows
    scale: real  # Seconds that pass in one second of its clock [1]


@device_struct
class Drive:
    """What acts on a world at an instant, and where the world is then.

    A drive that `located` has put somewhere is called `here`: it knows its posture, and the arms of
    its routed tendons there.
    """

    world: int  # Whose numbers of the mechanism it has
    time: real  # Instant [s]
    command: TendonVector  # Angles that the servos act on [rad], or measured forces [N]
    voltage: real  # Supply [V]; 0 stands for the actuator's own
    enabled: real  # Whether the servos give torque (1) or hang loose (0)
    elapsed: real  # Time [s] since the memory was current
    acceleration: JointVector  # Mean acceleration since then [rad/s2, m/s2]
    memory: MemoryVector  # What the world remembered then
    remembers: real  # Whether any effect with memory is awake (1)
    asleep: Flags  # Effects whose parameters are all null, a bit each
    inertia: real  # How much more than their weight the links resist [1]
    gravity: Place  # In the axes of the base [m/s2]
    friction: JointVector  # Dry friction of the joints [N m] or [N]
    dry: real  # Sum of the strengths of the tendons' dry frictions; 0: there is none
    greatest_speed: TendonVector  # Greatest speeds of the motors at their strings [m/s]
    slack: TendonVector  # What was decided at the start of a step: 0 nothing, 1 taut, 2 slack
    string: TendonVector  # Stiffness of the strings of spools that move on their own [N/m]
    carried: TendonVector  # What the gears of shafts carry [N]; 0 where that is not known
    tilt: Annotated[real, HAS_BODY]  # How far the bench is tipped about +y [rad]
    # What the other chains do to the free body, at its coordinates [N, N m]
    load: Annotated[JointVector, SHARES_BODY]
    q: JointVector  # Coordinates [rad, m]
    v: JointVector  # Rates of the coordinates [rad/s, m/s]
    length: Annotated[TendonVector, ROUTED]  # Excursions [m]
    arms: Annotated[ArmMatrix, ROUTED]  # Moment arms [m]
    bow: Annotated[TendonVector, ROUTED]  # What the tendons accelerate by at q_ddot = 0 [m/s2]
    bend: Annotated[BendMatrix, ROUTED]  # Derivatives of the arms by the joints [m/rad]


@device_struct
class ChainTerms:
    """What moves a chain without its tendons: M q_ddot = torque."""

    mass_matrix: JointMatrix  # M(q)
    torque: JointVector  # Torque of gravity and velocities [N m] or [N]


@device_struct
class Forces:
    """What moves a world in frozen contact states, with its derivatives."""

    mass_matrix: JointMatrix  # M(q), rotors included
    torque: JointVector  # [N m] or [N], without what holds
    stiffness: JointMatrix  # Derivative of the torque by the coordinates
    damping: JointMatrix  # Derivative of the torque by their rates
    slack: TendonVector  # Whether each string is taut (1) or slack (2)
    line: TendonVector  # Force [N] that a string would carry if it could push
    # What the tendons pull the mechanism with [N]; where one is held, what holds it
    pull: TendonVector
    tension: TendonVector  # What the load cells feel of sliding tendons, less the rotors' part [N]
    felt: TendonVector  # How much of the rotors the load cells feel [kg]
    arms: Annotated[RowMatrix, ROUTED]  # Rows of the tendons
    bow: Annotated[RowVector, ROUTED]  # What the rows accelerate by at q_ddot = 0 [m/s2]


@device_struct
class ContactStates:
    """What slides, sticks and touches."""

    joint_direction: JointVector  # Direction in which each joint slides
    joint_held: JointVector  # Whether it is held (1)
    touch: JointVector  # +1 or -1 where its upper or lower end stop pushes
    row_side: RowVector  # Side on which each row slides; see `contact_states`
    row_held: RowVector  # Whether it is held (1)
    least_side: RowVector  # The side with the least force, where a row may be held
    most_side: RowVector  # The side with the greatest
    hold: RowVector  # Pull of the rows that are held [N]


@device_struct
class Beginning:
    """What a step begins with."""

    contact: ContactStates  # The contact states
    forces: Forces  # The forces in them
    known: real  # Whether the forces are found already (1)


@device_struct
class Motion:
    """Where a step ends."""

    q: JointVector  # Coordinates [rad, m]
    v: JointVector  # Rates of the coordinates [rad/s, m/s]
    mass_matrix: JointMatrix  # M(q) there, to the order of the step
    memory: MemoryVector  # What the world remembers
    divided: real  # Whether an event has divided the step (1)
    # Force [N] that each string would have carried at the start if it could push
    line: TendonVector
    contact: ContactStates  # The contact states in which the step began
    arms: Annotated[RowMatrix, ROUTED]  # Rows of the tendons at its end


@device_struct
class Event:
    """What ends the contact states of a step."""

    fraction: real  # Share of the step after which it happens; 1: it does not
    row: int  # Row that comes to a speed at which it may be held: a joint, or J + a tendon's row
    speed: real  # That speed [rad/s, m/s]
    joint: int  # Joint that meets or leaves an end stop
    touch: real  # Which one it is then in touch with
    tendon: int  # Tendon whose string comes loose or is caught
    slack: real  # Which it then is: 1 taut, 2 slack


@device_struct
class Flow:
    """What flows along a tendon."""

    angle: Jet  # Angle that the servo acts on [rad]
    error: Jet  # Position error that it acts on [rad]
    duty: Jet  # Share of all that it has which it gives [1], where an effect asks for it
    motor_force: Jet  # Motor's force at the spool [N]
    tension: Jet  # Tension at the load cell [N]
    pull: Jet  # What reaches the mechanism [N]
    line: real  # Tension that the string would carry if it could push [N]
    slack: real  # Whether it is taut (1) or slack (2)
    tension_gain: real  # Share of a rotor's inertia force that the load cell feels [1]
    pull_gain: real  # Share of it that the mechanism feels [1]


@device_struct
class FreeEquation:
    """An equation matrix x = load in which some joints are held."""

    matrix: JointMatrix  # Matrix; rows and columns of held joints are those of one
    load: JointVector  # Load; zero at held joints
    arms: RowMatrix  # Tendons' rows, zero along them [m] or [1]


@device_struct
class Spool:
    """Forces at both ends of a string whose spool moves on its own."""

    inertia: real  # Inertia of the rotor, as felt at its string [kg]
    force: Jet  # What accelerates the rotor [N]
    force_by_lead: real  # Derivative of this force by the spool's lead [N/m]
    pull: Jet  # What reaches the mechanism [N]
    pull_by_lead: real  # Derivative of this pull by the spool's lead [N/m]


@device_struct
class Reading:
    """What the sensors of a world say."""

    angle: TendonVector  # What the encoders report [rad]
    angle_rate: TendonVector  # Rates of these angles [rad/s]
    force: TendonVector  # True tensions at the load cells [N]
    current: TendonVector  # Currents of the motors [A]


@device_struct
class Cell:
    """Load cells that are late or lag, between two substeps."""

    force: TendonVector  # What they would show now [N]
    due: TendonRows  # Rows whose readings are due next
    before: TendonVector  # True tensions at the start of a substep [N]
    after: TendonVector  # True tensions at its end [N]


# --- where joints are, and routed tendons


@device_struct
class JointPose:
    """Where the joints of a tree are, in the axes of the base."""

    origin: SpaceMatrix  # [m]
    axis: SpaceMatrix  # [1]
    rotation: TurnMatrix  # How the joints' links are turned


@device_struct
class SpanTerms:
    """Length of a span and its derivatives by both ends."""

    length: real  # [m]
    start: Vec3  # By the start [1]
    end: Vec3  # By the end [1]
    start_start: Mat33  # Twice by the start [1/m]
    start_end: Mat33  # By both [1/m]
    end_end: Mat33  # Twice by the end [1/m]


@device_struct
class RouteTerms:
    """Length of spans and its derivatives by the joints."""

    length: real  # [m]
    slope: JointVector  # [m/rad]
    bend: LinkMatrix  # [m/rad2]


@device_struct
class Routes:
    """Lengths of all tendons' spans and their derivatives by the joints."""

    length: TendonVector  # [m]
    slope: ArmMatrix  # [m/rad]
    bend: BendMatrix  # [m/rad2]


# --- contacts


@device_struct
class ContactPose:
    """Where joints and capsules are, in the axes of the base."""

    origin: SpaceMatrix  # Origins of the joints [m]
    axis: SpaceMatrix  # Axes of the joints [1]
    start: CapsuleMatrix  # Where the capsules' axes begin [m]
    end: CapsuleMatrix  # Where they end [m]
    body_place: Annotated[Vec3, HAS_BODY]  # Centre of the free body [m]
    body_frame: Annotated[Mat33, HAS_BODY]  # Axes of the free body, as columns [1]


@device_struct
class Surface:
    """An obstacle as a point sees it."""

    distance: real  # [m], negative inside
    normal: Vec3  # Direction away from it [1]


@device_struct
class Overlap:
    """How a capsule and an obstacle overlap."""

    depth: real  # [m]; they touch where it is positive
    normal: Vec3  # Direction in which the capsule is pushed [1]
    point: Vec3  # Where [m]


@device_struct
class Grip:
    """Forces of one contact, and their derivatives."""

    force: real  # Along the normal [N]
    stiffness: real  # Derivative of the force by the way along the normal [N/m]
    damping: real  # Derivative of the force by the speed along the normal [N s/m]
    drag: Vec3  # Friction [N]
    direction: Vec3  # Direction of the friction where it slides [1], zero where it sticks
    shear_stiffness: real  # Derivative of the friction by the way sideways [N/m]
    shear_damping: real  # Derivative of the friction by the speed sideways [N s/m]
    stretch: Vec3  # How far friction has stretched the contact [m]
    depth: real  # How deep it is [m]; 0: it does not touch
    normal: Vec3  # Along which it pushes its link [1]
    friction: real  # Coefficient of friction [1]
    columns: SpaceMatrix  # How the joints move it [m/rad], shape (J, 3)


@device_struct
class ContactTerms:
    """What contacts do to the joints."""

    torque: JointVector  # [N m] or [N]
    stiffness: JointMatrix  # Derivative of the torque by the coordinates
    damping: JointMatrix  # Derivative of the torque by the rates
