"""Numbers of a bench that change from day to day, and what to do about each."""

from dataclasses import dataclass

from tendon_newton.data.servo_names import effect_of
from tendon_newton.effects import are_one_friction


@dataclass(frozen=True, kw_only=True)
class Walk:
    """Effect whose number use or hands change."""

    what: str  # Thing that grows or falls, in words
    words: str  # Reason, in words
    mend: str  # What to do about it, as a command
    wears: int = 0  # Whether wear lets the number grow (1), fall (-1), or may do either (0)
    odds: float = 3.0
    """Logarithm of the odds that it did not move since the last day [nat]: 1 in 20."""


WALKS: dict[str, Walk] = {
    "tendon_slack": Walk(
        what="slack",
        words="a knot that gave way, a stretched tendon",
        mend="retension the tendon",
        wears=1,
        odds=1.0,  # strings creep and loosen by the hour
    ),
    "position_offset": Walk(
        what="offset of the angle",
        words="a spool that has slipped, another home",
        mend="home the servo anew, and tighten its spool",
    ),
    "spool_radius_error": Walk(
        what="spool's radius",
        words="a tendon on its own windings",
        mend="unwind the spool, and measure it",
    ),
    "gain_error": Walk(
        what="strength of the servo",
        words="a weak magnet, a low supply",
        mend="measure the supply under load",
        wears=-1,
    ),
    "coulomb_friction": Walk(
        what="dry friction",
        words="a gear that has run dry, dirt",
        mend="clean and grease the gear",
        wears=1,
    ),
    "viscous_friction": Walk(
        what="viscous friction",
        words="grease that has thickened",
        mend="let the gear warm up, or grease it anew",
        wears=1,
    ),
    "load_dependent_friction": Walk(
        what="friction by load", words="worn teeth", mend="look at the gear's teeth", wears=1
    ),
    "holding_friction": Walk(
        what="holding friction",
        words="a gear that no longer turns back",
        mend="look at the gear's teeth",
        wears=1,
    ),
    "routing_friction": Walk(
        what="friction of the guides",
        words="a guide that the tendon has cut into",
        mend="look at the guides and the tendon's coat",
        wears=1,
    ),
    "tendon_compliance": Walk(
        what="stiffness of the tendon", words="another tendon", mend="say which tendon it is"
    ),
    "joint_dry_friction": Walk(
        what="dry friction of the joints",
        words="dirt in the joints",
        mend="clean the joints",
        wears=1,
    ),
    "joint_stiffness_error": Walk(
        what="stiffness of the springs", words="tired springs", mend="say which springs were put in"
    ),
    "obstruction": Walk(
        what="force of something in the way",
        words="something in the finger's way",
        mend="take it away",
        wears=1,
    ),
    "gravity_misalignment": Walk(
        what="tilt of the bench", words="a bench that was moved", mend="level the bench"
    ),
    "load_cell_gain": Walk(
        what="scale of the load cell",
        words="another amplifier, a cell that was overloaded",
        mend="calibrate the cell with a known mass",
    ),
    "load_cell_bias": Walk(
        what="zero of the load cell", words="a cell that was not tared", mend="tare the cell"
    ),
}
"""Effect -> what walks."""
SELDOM = 10.0
"""Such odds of a number that neither use nor hands change [nat]: 1 in 22,000, a choice."""
MENDED = "this is no wear: take the new model if somebody mended it"
"""What to do about a number that went the other way than wear lets it go."""


def walk_of(cause: str) -> Walk:
    """Return what walks with a cause's number, or with another form of its friction."""
    name = effect_of(cause)
    found = WALKS.get(name) or next(
        (walk for other, walk in WALKS.items() if are_one_friction(name, other)), None
    )
    what = name.replace("_", " ")
    return found or Walk(what=what, words="", mend="take the new model", odds=SELDOM)
