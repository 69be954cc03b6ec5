"""In words what a diagnosis finds on the recordings, against what the virtual bench contains."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from tendon_lab.reproduction.physical import starting_model
from tendon_newton.data.model_file import Model
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.effects import find_effect

Truth = Mapping[str, Mapping[str, Mapping[str, float]]]
IN_STARTING_MODEL = ("viscous_friction", "gain_error", "voltage_sag")
"""Effects of the plant that the model of the servo holds already: back-EMF, its constants, and the
voltage, which is logged."""
FITTED_ELSEWHERE = "On {count} nothing was named: fitted to those is what was named most often."


def causes_text(found: Sequence[Mapping[str, Any]], truth: Truth) -> str:
    """Say on how many benches each cause was named, where each bench was diagnosed."""
    verdicts = Counter(each["json"][0]["verdict"].replace("_", " ") for each in found)
    named = Counter(name for each in found for name in cause_names(each))
    silent = sum(not cause_names(each) for each in found)
    rivals = Counter(name for each in found for name in each["rivals"])
    contained = in_plant(truth)
    lines = [
        f"First verdict, by bench: {', '.join(f'{n} {word}' for word, n in verdicts.items())}."
    ]
    order = sorted({*named, *rivals}, key=lambda name: (-named[name], -rivals[name], name))
    if not order:
        return lines[0]
    if silent:
        lines.append(FITTED_ELSEWHERE.format(count=silent))
    lines += [
        "",
        f"| of {len(found)} benches | named | not told from what was named | in the plant |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {named[name]} | {rivals[name]} "
        f"| {'not known' if not truth else 'yes' if name in contained else 'no'} |"
        for name in order
    ]
    return "\n".join(lines)


def cause_names(found: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the causes that all passes on a bench have named, in alphabetical order."""
    return tuple(sorted({effect["name"] for own in found["json"] for effect in own["effects"]}))


def in_plant(truth: Truth) -> set[str]:
    """Return the effects of a plant and their special cases, which are right names too."""
    contained = {name for own in truth.values() for name in own}
    return contained | {n for effect in contained for n in find_effect(effect).includes}


def passes_text(passes: Sequence[Diagnosis]) -> str:
    """Say what each diagnosis named, and what it was worth."""
    lines = [
        "| pass | verdict | named | angle before, after [mrad] | force before, after [N] |",
        "|---|---|---|---|---|",
    ]
    for place, found in enumerate(passes, start=1):
        named = "; ".join(
            effect.name
            + (
                f" (or {', '.join(effect.indistinguishable_from)})"
                if effect.indistinguishable_from
                else ""
            )
            for effect in found.effects
        )
        before, after = found.baseline, found.extended
        lines.append(
            f"| {place} | {found.verdict.replace('_', ' ')} | {named or 'nothing'} "
            f"| {1e3 * before.theta_rmse:.1f}, {1e3 * after.theta_rmse:.1f} "
            f"| {before.force_rmse or 0.0:.2f}, {after.force_rmse or 0.0:.2f} |"
        )
    return "\n".join(lines)


def rivals_of(passes: Sequence[Diagnosis]) -> dict[str, str]:
    """Return effect -> the named cause that the data cannot tell from it."""
    return {
        rival: effect.name
        for diagnosis in passes
        for effect in diagnosis.effects
        for rival in effect.indistinguishable_from
    }


def truth_text(model: Model, truth: Truth, rivals: Mapping[str, str]) -> str:
    """Say what the bench contains, what was named of it, and what was not."""
    if not truth:
        return "What these benches really contain is not known."
    named = {effect.name: effect.values for effect in model.effects}
    contained = tuple(dict.fromkeys(name for own in truth.values() for name in own))
    lines = ["| in the plant | true, by bench | found |", "|---|---|---|"]
    lines += [
        f"| {effect} | {true_text(effect, truth)} | {answer_text(effect, named, rivals)} |"
        for effect in contained
    ]
    wrong = [name for name in named if name not in in_plant(truth)]
    starting = starting_model().actuator.values
    fitted = ", ".join(
        f"{name} {float(model.actuator.values[name]):.3g} (data sheet {float(starting[name]):.3g})"
        for name in model.fit
    )
    return "\n".join(
        [
            *lines,
            "",
            f"Named and not in the plant: {', '.join(wrong) or 'nothing'}.",
            f"Fitted with every candidate: {fitted}.",
        ]
    )


def true_text(effect: str, truth: Truth) -> str:
    """Write what the plant has of an effect; benches with the same numbers stand together."""
    benches: dict[str, list[str]] = {}
    for bench, own in truth.items():
        if effect in own:
            benches.setdefault(numbers_text(own[effect]), []).append(bench)
    if len(benches) == 1 and len(next(iter(benches.values()))) == len(truth):
        return next(iter(benches))
    return "; ".join(f"{', '.join(names)}: {numbers}" for numbers, names in benches.items())


def answer_text(
    effect: str, named: Mapping[str, Mapping[str, float | str]], rivals: Mapping[str, str]
) -> str:
    """Say what was found of an effect of the plant: it, its special case, a rival, or nothing."""
    if effect in named:
        return numbers_text(named[effect])
    for special in find_effect(effect).includes:
        if special in named:
            return f"as {special}: {numbers_text(named[special])}"
    if effect in rivals:
        return f"not told from {rivals[effect]}"
    return "in the starting model" if effect in IN_STARTING_MODEL else "missed"


def numbers_text(values: Mapping[str, float | str]) -> str:
    """Write some parameters."""
    return ", ".join(f"{name} {float(value):.3g}" for name, value in values.items()) or "there"
