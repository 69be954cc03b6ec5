"""Numbers and causes in words: what a report says about a diagnosis."""

import inspect
import re
from collections.abc import Mapping
from dataclasses import replace

from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.plain_numbers import estimate_text, finer, is_share, number, quantity
from tendon_newton.data.servo_names import effect_of, servo_of
from tendon_newton.diagnosis.result import Diagnosis, NamedEffect
from tendon_newton.effects import EFFECTS, law_of

SENTENCES: dict[str, str] = {
    # {parameter} is the number with its unit, {parameter:size} without its sign, {parameter:loss}
    # for each rad/s, {parameter:than} a scale in comparison with the model. Of [a|b] a stands below
    # the null of the first parameter and b above.
    "actuator_lag": "The servo's force follows with a lag of {time_constant}",
    "backlash": "The gear has {width} of play",
    "command_delay": "The servo acts {delay} late",
    "coulomb_friction": "A dry friction of {force} opposes the tendon's motion in the servo",
    "current_sensor_delay": "The motor's current is read {delay} late",
    "current_sensor_gain": "What is read of the motor's current is {scale:than}",
    "deadband": "The servo ignores position errors up to {width}",
    "force_saturation": "The servo's force stops at {limit}",
    "gain_drift": "Over a recording the servo's gain [rises|fades] by {rate:size}",
    "gain_error": "The servo's force for the same position error is {scale:than}",
    "gear_load_friction": "The servo's gear rubs with {coefficient} of what motor and tendon press "
    "it with",
    "gravity_misalignment": "The bench is tilted by {angle:size}, [against|with] the tendon's pull",
    "inertia_error": "The inertia of the moving parts is {scale:than}",
    "joint_damping_error": "The joints' damping is {scale:than}",
    "joint_dry_friction": "The joints rub with {fraction} of their springs' full torque",
    "joint_stiffness_error": "The return springs' stiffness is {scale:than}",
    "joint_encoder_delay": "The joints' encoders come {delay} late",
    "joint_encoder_gain": "What the joints' encoders read is {scale:than}",
    "load_cell_bias": "The load cell reads {offset:size} too [low|high]",
    "load_cell_delay": "The load cell's readings come {delay} late",
    "load_cell_drift": "The load cell drifts [down|up] by {rate:size}",
    "load_cell_gain": "What the load cell reads is {scale:than}",
    "load_cell_lag": "The load cell follows with a lag of {time_constant}",
    "load_dependent_friction": "Friction in the servo eats {coefficient} of the tension",
    "load_stribeck_friction": "The servo's gear holds {static_coefficient} of what motor and "
    "tendon press it with, and rubs with {coefficient} as it moves",
    "obstruction": "Something is in the way from a motor angle of {position} on",
    "position_offset": "The encoder's zero is {angle:size} too [low|high]",
    "routing_friction": "Friction along the tendon's path has a capstan exponent of {exponent}",
    "speed_limit": "The motor cannot turn faster than {limit}",
    "spool_radius_error": "The spool's radius is {scale:than}",
    "spring_stiffening": "The return springs [soften|stiffen] towards the end of the range",
    "stribeck_friction": "Dry friction of {static_force} holds the servo and falls to "
    "{coulomb_force} as it moves",
    "tendon_compliance": "The tendon stretches like a spring of {stiffness}",
    "tendon_slack": "The tendon has {length} of slack",
    "torque_fade": "The servo tires under load, within {time_constant}",
    "tip_sensor_delay": "What sees the tip comes {delay} late",
    "tip_sensor_gain": "How far the tip is seen to move is {scale:than}",
    "viscoelastic_spring": "The return springs creep with a time constant of {relaxation_time}",
    "voltage_sensor_sag": "The supply is read to give way [less|more] than it does, by {sag:size}",
    "viscous_friction": "The servo loses {coefficient:loss} for every rad/s at which it turns",
}
"""What a cause means for a bench; an effect without one is told by its docstring's first line."""


def with_owner(cause: str, servos: int) -> str:
    """Return a cause's name with its owner, as in ``command_delay of both servos``.

    Args:
        cause: Name of the cause, which says the one servo that it is of.
        servos: Servos of the bench; nothing is said of an only one.
    """
    if servos == 1 or servo_of(cause) is not None or not law_of(cause).is_of_servo():
        return cause
    return f"{cause} of {'both' if servos == 2 else f'all {servos}'} servos"


def comparison(scale: float) -> str:
    """Return a factor as a comparison with the model."""
    if 0.5 < scale < 2.0:
        direction = "more" if scale > 1.0 else "less"
        return f"{100.0 * abs(scale - 1.0):.0f} % {direction} than the model says"
    return f"{number(scale, 2)} times what the model says"


def cause_text(cause: str, values: Mapping[str, float], scale: BenchScale) -> str:
    """Return a cause with its numbers, named where there are several."""
    known = law_of(cause).parameters if effect_of(cause) in EFFECTS else ()
    units = {parameter.name: parameter.on(scale).unit for parameter in known}
    numbers = [quantity(value, units.get(name, "1")) for name, value in values.items()]
    if len(numbers) > 1:
        numbers = [f"{name} {text}" for name, text in zip(values, numbers, strict=True)]
    return f"{cause} {', '.join(numbers)}".rstrip()


def cause_sentence(effect: NamedEffect) -> str:
    """Return one cause as a sentence without its full stop."""
    declared, servo = law_of(effect.name), servo_of(effect.name)
    whose = "The finger of servo" if declared.side == "mechanism" else "Servo"
    owner = "" if servo is None else f"{whose} {servo}: "
    return owner + law_sentence(replace(effect, name=declared.name))


def law_sentence(effect: NamedEffect) -> str:
    """Return what an effect is as a sentence, whosever it is."""
    declared = law_of(effect.name)
    if effect.name not in SENTENCES:
        return f"{docstring_part(effect.name).rstrip('.')} ({effect.name.replace('_', ' ')})"
    first = declared.parameters[0]
    above = effect.parameters[first.name].value >= first.null
    chosen = re.sub(
        r"\[([^|]*)\|([^]]*)\]", lambda m: m[2] if above else m[1], SENTENCES[effect.name]
    )
    return re.sub(r"\{(\w+)(?::(\w+))?\}", lambda m: field(effect, m[1], m[2]), chosen)


def field(effect: NamedEffect, parameter: str, form: str | None) -> str:
    """Fill one place of a sentence, no finer than the interval resolves."""
    estimate = effect.parameters[parameter]
    if form == "than":
        return comparison(estimate.value)
    if form == "loss":
        return f"{number(estimate.value)} {estimate.unit.removesuffix(' s/rad')}"
    value = abs(estimate.value) if form == "size" else estimate.value
    known, _ = estimate_text(effect.name, parameter, estimate)
    digits = sum(c.isdigit() for c in known.split()[0].lstrip("−0."))
    factor, unit = (1e-2, "%") if is_share(effect.name, parameter) else finer(value, estimate.unit)
    return f"{number(value / factor, min(3, max(1, digits)))} {unit}".rstrip()


def docstring_part(effect: str, heading: str | None = None) -> str:
    """Return the first line of an effect's docstring, or what follows ``heading:``, on one line."""
    text = inspect.getdoc(law_of(effect)) or effect
    if heading is None:
        return text.splitlines()[0]
    found = re.search(rf"^{heading}: (.*?)(?=^[A-Z][\w ]+: |\Z)", text, re.DOTALL | re.MULTILINE)
    plain = re.sub(r":\w+:`([^`]*)`|``([^`]*)``", r"\1\2", found[1] if found else "")
    return " ".join(plain.split())


HEADLINES = {
    "no_gap": "No gap: what the model leaves over is noise, as far as this data can tell.",
    "unexplained": "There is a gap, and no cause that the catalogue knows accounts for it.",
}
UNDECIDED = (
    "There is a gap. The time ended before causes could be told: this is no finding about any."
)
COUNTS = ("No", "One", "Two", "Three", "Four", "Five", "Six", "Seven")


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict in one sentence."""
    text = finished_headline(diagnosis)
    if diagnosis.finished:
        return text
    if diagnosis.verdict == "unexplained":
        return f"Unfinished search. {UNDECIDED}"
    return f"Unfinished search. So far: {text[0].lower()}{text[1:]}"


def finished_headline(diagnosis: Diagnosis) -> str:
    """Return the verdict of a search that came to its end."""
    if diagnosis.verdict in HEADLINES:
        more = " beyond what the starting model has" if diagnosis.start else ""
        return HEADLINES[diagnosis.verdict].replace("There is a gap", f"There is a gap{more}")
    count = len(diagnosis.effects) + (diagnosis.actuator is not None)
    word = COUNTS[count] if count < len(COUNTS) else str(count)
    causes = f"{word} cause{'s' * (count != 1)}"
    classes = [len(e.indistinguishable_from) for e in diagnosis.effects]
    if diagnosis.verdict == "explained":
        text = f"{causes} account{'s' * (count == 1)} for the gap"
    else:
        text = f"{causes} found, and something else remains"
    if not any(classes):
        return f"{text}."
    if count == 1:
        return f"{text}; which of {COUNTS[1 + classes[0]].lower()} it is, this data cannot tell."
    return f"{text}; not all of them can be told from others."


HARDLY_THERE = (
    "Held-out recordings hardly show the causes that were found: they confirm none and contradict "
    "none. Keep back a recording in which these act."
)
CONSEQUENCES: Mapping[str, str] = {
    "no_gap": "No effect of the catalogue improves the prediction of recordings that it was not "
    "fitted on by more than chance would. The model stays as it is.",
    "explained": "With this in the model, nothing remains that calls for another cause.",
    "partly_explained": "This holds on recordings that it was not fitted on, but what remains is "
    "more than noise: do not read it as the whole story.",
    "unexplained": "The error is larger than noise, but naming an effect would be a guess. The "
    "model stays as it is; see “What remains”.",
}


def consequence(diagnosis: Diagnosis) -> str:
    """Say what the verdict means for the model, or that held-out recordings cannot tell."""
    return HARDLY_THERE if HARDLY_THERE in diagnosis.notes else CONSEQUENCES[diagnosis.verdict]
