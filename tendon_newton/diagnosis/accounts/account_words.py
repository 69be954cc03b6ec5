"""Why a cause was named or not, in plain sentences, and what would tell.

Scores are in nat per row: a gain of g makes the residuals smaller by the share 1 - exp(-g).
"""

import math
from collections.abc import Callable

from tendon_newton.data.plain_numbers import estimate_text
from tendon_newton.data.servo_names import effect_of, servo_of
from tendon_newton.diagnosis.accounts.account_file import Account
from tendon_newton.diagnosis.report_words import cause_text, docstring_part
from tendon_newton.diagnosis.result import Criterion
from tendon_newton.diagnosis.search.decide.account import (
    ADDED,
    BEHIND,
    BEYOND,
    HELD_OUT,
    IN_RANGE,
    LOSS,
    OPEN,
    REMAINS,
    TOGETHER,
)
from tendon_newton.effects import EFFECTS, law_of

MANY = 3  # Recordings that are told by name


def sentences(cause: Account) -> list[str]:
    """Return why a cause was named or not, and what would tell, in the order of reading."""
    share = f"{percent(cause.share)} of the gap" if cause.share > 0.0 else "nothing"
    out = [f"{what(cause)} explains {share} alone{places(cause)}."]
    if cause.answer:
        told = {n: estimate_text(effect_of(cause.name), n, e) for n, e in cause.answer.items()}
        numbers = ", ".join(f"{name} {text} ({within})" for name, (text, within) in told.items())
        out.append(f"In the answer, beside all that was found, its {numbers}.")
    out.append(outcome(cause))
    out += [LONG.get(criterion.name, plainly)(criterion) for criterion in cause.criteria]
    return [*out, *what_would_tell(cause)]


def line(cause: Account) -> str:
    """Return an account on one line: name, share alone, and what became of it."""
    return f"{cause.name:28s} {percent(max(0.0, cause.share)):>6s}  {short_outcome(cause)}"


def what(cause: Account) -> str:
    """Return a cause with its numbers."""
    return cause_text(cause.name, cause.values, cause.scale)


def places(cause: Account) -> str:
    """Say in which recordings a cause acts, as the end of a sentence."""
    if cause.acts_in is None or not cause.looked_at:
        return ""
    count = len(cause.acts_in)
    if count == cause.looked_at:
        return f" and acts in all {count} recordings" if count > 1 else ""
    named = f" ({', '.join(cause.acts_in)})" if 0 < count <= MANY else ""
    return f" and acts in {count or 'none'} of {cause.looked_at} recordings{named}"


def outcome(cause: Account) -> str:
    """Say whether a cause was named, and by what it was stopped."""
    if cause.named and cause.rivals:
        return f"It was named, and the data cannot tell it from {', '.join(cause.rivals)}."
    if cause.named:
        return "It was named: it passed everything that is asked."
    if cause.rival_of:
        return f"It was not named alone: the data cannot tell it from {', '.join(cause.rival_of)}."
    if any(c.name == TOGETHER for c in cause.failed):
        return "It was found and not named: with all causes found too much is left."
    if cause.at_bound:
        return (
            f"It was not named: {', '.join(cause.at_bound)} ended at the edge of the range. "
            "Something that the range rules out fits better."
        )
    if cause.failed:
        return "It was not named, since it did not pass what is asked:"
    return "It was not named: another set of causes explains the data at less cost."


def short_outcome(cause: Account) -> str:
    """Say the same in a few words."""
    if cause.named:
        return "named" + (f"; or {', '.join(cause.rivals)}" if cause.rivals else "")
    if cause.rival_of:
        return f"not told apart from {', '.join(cause.rival_of)}"
    if cause.at_bound and not any(c.name == TOGETHER for c in cause.failed):
        return f"{', '.join(cause.at_bound)} at the edge of the range"
    if cause.failed:
        criterion = cause.failed[0]
        return SHORT.get(criterion.name, plainly)(criterion)
    return "another set explains the data at less cost"


def what_would_tell(cause: Account) -> list[str]:
    """Say what to record to be surer of a cause."""
    if cause.experiment:
        return [f"To tell them apart, {cause.experiment}."]
    if cause.rival_of:
        return ["To tell them apart, record what the verb experiment proposes."]
    if cause.named or effect_of(cause.name) not in EFFECTS:
        return []
    out: list[str] = []
    signature = docstring_part(cause.name, "Signature")
    if signature:
        out.append(f"What would tell: recordings that show its mark. Its mark is: {signature}")
    confused = docstring_part(cause.name, "Confused with")
    if confused:
        out.append(f"It is easily confused with: {confused}")
    if cause.acts_in and len(cause.acts_in) < cause.looked_at:
        out.append(f"Record more like {cause.acts_in[0]}: there it acts.")
    return out


def not_tried(name: str, *, has_force: bool, servos: int) -> list[str]:
    """Say why an effect of the catalogue stands in no account."""
    effect, servo = law_of(name), servo_of(name)
    if servo is not None and servo >= servos:
        there = "servo 0 alone" if servos == 1 else f"the servos 0 to {servos - 1}"
        why = f"The recordings have no servo {servo}: they have {there}."
    elif servo is not None and (servos == 1 or not effect.is_of_servo()):
        whose = "of the only servo" if effect.is_of_servo() else "of the bench, and of no servo"
        why = f"This effect is {whose}: ask for {effect_of(name)}."
    elif effect.acts_on_cell_only() and not has_force:
        why = "It changes only what a load cell reads, and the recordings have no force."
    elif effect.needs_string:
        why = "It needs a string, a guide or a spool, or something else that these benches lack."
    else:
        why = "It cannot act on the benches that were recorded, or the model drives nothing there."
    return [f"{name} was not tried. {why}"]


def plainly(criterion: Criterion) -> str:
    """Say a criterion that has no sentence of its own."""
    passed = "passed" if criterion.passed else "not passed"
    return f"{criterion.name}: {criterion.value:.3g}, asked {criterion.bar:.3g}: {passed}."


def smaller(gain: float) -> str:
    """Return by how much a gain in score makes residuals smaller."""
    return f"{percent(1.0 - math.exp(-gain))} smaller" if gain > 0.0 else "no smaller"


def larger(loss: float) -> str:
    """Return by how much a loss in score makes residuals larger."""
    if loss > math.log(2.0):
        return f"{math.exp(min(loss, 20.0)):.2g} times as large"
    return f"{percent(math.exp(loss) - 1.0)} larger" if loss > 0.0 else "no larger"


def percent(share: float) -> str:
    """Return a share in per cent, one decimal where it is small."""
    value = 100.0 * share
    text = f"{value:.1f}" if 0.0 < abs(value) < 1.0 else f"{value:.0f}"
    return f"{text} %".replace("-", "−")


LONG: dict[str, Callable[[Criterion], str]] = {
    LOSS: lambda c: (
        f"Beside the other causes it makes the residuals {smaller(c.value)}; "
        f"{smaller(c.bar)} is asked."
    ),
    HELD_OUT: lambda c: (
        "On parts of the data that no number had seen it makes them "
        f"{smaller(c.value)}; {smaller(c.bar)} is asked."
    ),
    IN_RANGE: lambda c: (
        "All its numbers lie inside their ranges."
        if c.passed
        else "A number ended at the edge of its range: what the range rules out fits better."
    ),
    BEYOND: lambda c: (
        f"It is a stated number, {c.value:.1f} tolerances off: measure it; up to {c.bar:.2g} any "
        "bench has."
    ),
    REMAINS: lambda c: (
        "It is worth enough beside what no cause explains."
        if c.passed
        else f"Something is left that no cause explains, and without this one residuals are "
        f"{larger(c.value)}; {larger(c.bar)} is asked there: it is suspected, not named."
    ),
    OPEN: lambda c: (
        "Its interval leaves out that there is nothing."
        if c.passed
        else "Its interval holds the value that means nothing: it is suspected, not named."
    ),
    ADDED: lambda c: (
        f"Added to the causes found, it promises residuals {smaller(c.value)}; "
        f"{smaller(c.bar)} is asked."
    ),
    BEHIND: lambda c: (
        "In real refits no set without it does better."
        if c.passed
        else "In real refits the best set with it was beaten: its residuals, with a price for "
        f"every cause, are {larger(c.value)}."
    ),
    TOGETHER: lambda c: (
        f"All causes found together leave {percent(c.value)} of the squared error "
        f"above the noise; at most {percent(c.bar)} may be left."
    ),
}
SHORT: dict[str, Callable[[Criterion], str]] = {
    BEYOND: lambda c: f"{c.value:.1f} tolerances from what is stated; {c.bar:.2g} asked",
    LOSS: lambda c: f"residuals {smaller(c.value)}; {smaller(c.bar)} asked",
    HELD_OUT: lambda c: f"on unseen data residuals {smaller(c.value)}; {smaller(c.bar)} asked",
    IN_RANGE: lambda _: "a number at the edge of its range",
    REMAINS: lambda c: f"residuals {larger(c.value)} without it beside what is unexplained",
    OPEN: lambda _: "an interval that holds the value that means nothing",
    ADDED: lambda c: (
        f"residuals {smaller(c.value)}; {smaller(c.bar)} asked"
        if c.value > 0.0
        else "adds nothing to the causes found"
    ),
    BEHIND: lambda c: f"the best set with it was beaten: residuals {larger(c.value)}",
    TOGETHER: lambda c: f"found, but all causes leave {percent(c.value)}",
}
