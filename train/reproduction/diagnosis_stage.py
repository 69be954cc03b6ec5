"""What a diagnosis finds on the recordings, against what the virtual bench really contains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
from train.reproduction.unit import RECORDINGS, Unit, representative

Truth = Mapping[str, Mapping[str, Mapping[str, float]]]
IN_STARTING_MODEL = ("viscous_friction", "gain_error", "voltage_sag")
"""Effects of the plant that the model of the servo holds already: back-EMF, its constants, and the
voltage, which is logged."""


def run(reproduction: Reproduction) -> Outcome:
    """Diagnose the first bench, and the others or their numbers."""
    first = reproduction.units[0]
    passes = () if reproduction.causes is not None else diagnosed(reproduction, first)
    found = {unit.name: physical_model(reproduction, unit) for unit in reproduction.units}
    truth = true_effects(first.folder / RECORDINGS)
    return Outcome(
        numbers={
            "passes": [diagnosis.to_json() for diagnosis in passes],
            "models": {name: numbers_of(model) for name, model in found.items()},
            "truth": {bench: {e: dict(p) for e, p in own.items()} for bench, own in truth.items()},
        },
        text="\n\n".join(
            [passes_text(passes), truth_text(found[first.name], truth, rivals_of(passes))]
        ),
    )


def physical_model(reproduction: Reproduction, unit: Unit) -> Model:
    """Return the physical model of a bench, and write it."""
    settings, first = reproduction.settings, reproduction.units[0]
    if reproduction.causes is None and unit is not first and settings.diagnoses_each_unit:
        diagnosed(reproduction, unit)
    named_on = unit if settings.diagnoses_each_unit else first
    source = reproduction.causes or reproduction.model_file(named_on, "diagnosed")
    reproduction.tell(f"  {unit.name}: fitting the numbers of what {source} names")
    part = representative(unit, settings.refit_seconds, settings.diagnosis_kinds)
    model = refit(part, load_model(source))
    write_model(reproduction.model_file(unit, "physical"), model)
    return model


def diagnosed(reproduction: Reproduction, unit: Unit) -> tuple[Diagnosis, ...]:
    """Diagnose one bench, write what was found, and return it."""
    settings = reproduction.settings
    model, passes = diagnose_in_passes(
        representative(unit, settings.diagnosis_seconds, settings.diagnosis_kinds),
        settings.diagnosis_passes,
        lambda text: reproduction.tell(f"  {unit.name}: {text}"),
    )
    for place, diagnosis in enumerate(passes, start=1):
        folder = reproduction.folder("models", unit.name)
        write_diagnosis(folder / f"diagnosis_{place}.json", diagnosis)
    write_model(reproduction.model_file(unit, "diagnosed"), model)
    return passes


def numbers_of(model: Model) -> dict[str, dict[str, float | str]]:
    """Return a model's numbers by actuator and effect."""
    named = (model.actuator, *model.effects)
    return {part.name: dict(part.values) for part in named}


def passes_text(passes: Sequence[Diagnosis]) -> str:
    """Say what each diagnosis named, and what it was worth."""
    if not passes:
        return "The causes were given, and not looked for."
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
