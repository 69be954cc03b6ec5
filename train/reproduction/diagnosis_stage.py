"""What a diagnosis finds on the recordings, against what the virtual bench really contains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tendon_newton.diagnosis.result import Diagnosis, write_diagnosis
from tendon_newton.effects import find_effect
from tendon_newton.model_file import Model, load_model, write_model
from train.reproduction.outcome import Outcome
from train.reproduction.physical import (
    diagnose_in_passes,
    refit,
    starting_model,
    true_effects,
)
from train.reproduction.reproduction import Reproduction
from train.reproduction.unit import RECORDINGS, representative

Truth = Mapping[str, Mapping[str, Mapping[str, float]]]
IN_STARTING_MODEL = ("viscous_friction", "gain_error", "voltage_sag")
"""Effects of the plant that the model of the servo holds already: back-EMF, its constants, and the
voltage, which is logged."""
GIVEN = "The causes were given, and not looked for."


def run(reproduction: Reproduction) -> Outcome:
    """Diagnose the first bench, and the others or their numbers."""
    settings, units = reproduction.settings, reproduction.units
    looked_at = range(len(units)) if settings.diagnoses_each_unit else range(1)
    if reproduction.causes is not None:
        looked_at = range(0)
    found = reproduction.each(diagnosed, looked_at)
    models = reproduction.each(fitted, range(len(units)))
    truth = true_effects(units[0].folder / RECORDINGS)
    passes = found[0] if found else {"json": [], "text": GIVEN, "rivals": {}}
    return Outcome(
        numbers={
            "passes": passes["json"],
            "models": {unit.name: own for unit, own in zip(units, models, strict=True)},
            "truth": {bench: {e: dict(p) for e, p in own.items()} for bench, own in truth.items()},
        },
        text="\n\n".join(
            [
                passes["text"],
                truth_text(reproduction.model(units[0], "physical"), truth, passes["rivals"]),
                *([] if len(found) < 2 else [causes_text(reproduction, found)]),
            ]
        ),
    )


def diagnosed(reproduction: Reproduction, place: int) -> dict[str, Any]:
    """Diagnose one bench, write what was found, and return it as JSON and in words."""
    settings, unit = reproduction.settings, reproduction.units[place]
    model, passes = diagnose_in_passes(
        representative(unit, settings.diagnosis_seconds, settings.diagnosis_kinds),
        settings.diagnosis_passes,
        lambda text: reproduction.tell(f"  {unit.name}: {text}"),
    )
    for number, diagnosis in enumerate(passes, start=1):
        folder = reproduction.folder("models", unit.name)
        write_diagnosis(folder / f"diagnosis_{number}.json", diagnosis)
    write_model(reproduction.model_file(unit, "diagnosed"), model)
    return {
        "json": [diagnosis.to_json() for diagnosis in passes],
        "text": passes_text(passes),
        "rivals": rivals_of(passes),
    }


def fitted(reproduction: Reproduction, place: int) -> dict[str, dict[str, float | str]]:
    """Fit the numbers of the causes to a bench, write its physical model, and return them."""
    settings, unit = reproduction.settings, reproduction.units[place]
    named_on = unit if settings.diagnoses_each_unit else reproduction.units[0]
    source = reproduction.causes or reproduction.model_file(named_on, "diagnosed")
    reproduction.tell(f"  {unit.name}: fitting the numbers of what {source} names")
    part = representative(unit, settings.refit_seconds, settings.diagnosis_kinds)
    model = refit(part, load_model(source))
    write_model(reproduction.model_file(unit, "physical"), model)
    return numbers_of(model)


def causes_text(reproduction: Reproduction, found: Sequence[Mapping[str, Any]]) -> str:
    """Say on how many benches each cause was named, where each bench was diagnosed."""
    named = [
        {effect["name"] for own in each["json"] for effect in own["effects"]} for each in found
    ]
    counts = {name: sum(name in own for own in named) for name in sorted(set().union(*named))}
    lines = [f"| named | on benches, of {len(reproduction.units)} |", "|---|---|"]
    lines += [f"| {name} | {count} |" for name, count in counts.items()]
    return "\n".join(lines)


def numbers_of(model: Model) -> dict[str, dict[str, float | str]]:
    """Return a model's numbers by actuator and effect."""
    named = (model.actuator, *model.effects)
    return {part.name: dict(part.values) for part in named}


def passes_text(passes: Sequence[Diagnosis]) -> str:
    """Say what each diagnosis named, and what it was worth."""
    lines = [
        "| pass | verdict | named | angle before, after [mrad] | force before, after [N] |",
        "|---|---|---|---|---|",
    ]
    for place, found in enumerate(passes, start=1):
        named = "; ".join(
            effect.name
            + (f" (or {', '.join(effect.indistinguishable_from)})"
               if effect.indistinguishable_from else "")
            for effect in found.effects
        )  # fmt: skip
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
    covered = {*contained, *(n for effect in contained for n in find_effect(effect).includes)}
    wrong = [name for name in named if name not in covered]
    starting = starting_model().actuator.values
    fitted = ", ".join(
        f"{name} {float(model.actuator.values[name]):.3g} (data sheet {float(starting[name]):.3g})"
        for name in model.fit
    )
    return "\n".join([
        *lines, "", f"Named and not in the plant: {', '.join(wrong) or 'nothing'}.",
        f"Fitted with every candidate: {fitted}.",
    ])  # fmt: skip


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
