"""What a diagnosis finds on the recordings."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from tendon_lab.reproduction.outcome import Outcome
from tendon_lab.reproduction.physical import diagnose_in_passes, refit
from tendon_lab.reproduction.reproduction import Reproduction
from tendon_lab.reproduction.settings import ReproductionSettings
from tendon_lab.reproduction.unit import representative
from tendon_newton.data.model_file import Model, load_model, write_model
from tendon_newton.diagnosis.result import write_diagnosis

GIVEN = "The causes were given, and not looked for."


def run(reproduction: Reproduction) -> Outcome:
    """Diagnose the first bench, and the others or their numbers."""
    settings, units = reproduction.settings, reproduction.units
    looked_at = range(len(units)) if settings.diagnoses_each_unit else range(1)
    if reproduction.causes is not None:
        looked_at = range(0)
    found = reproduction.each(diagnosed, looked_at)
    models = reproduction.each(fitted, list(enumerate(sources(found, len(units)))))
    return Outcome(
        numbers={
            "passes": found[0] if found else [],
            "models": {unit.name: own for unit, own in zip(units, models, strict=True)},
        },
        text=scope_text(settings) if found else GIVEN,
    )


def diagnosed(reproduction: Reproduction, place: int) -> list[Any]:
    """Diagnose one bench, write what was found, and return it as JSON."""
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
    return [diagnosis.to_json() for diagnosis in passes]


def scope_text(settings: ReproductionSettings) -> str:
    """Say where causes are looked for, and where their numbers come from."""
    return (
        f"Causes are looked for in the first {settings.diagnosis_seconds:g} s of one recording of "
        f"each bench and each of {settings.diagnosis_kinds} kinds; their numbers are fitted to the "
        f"first {settings.refit_seconds:g} s of such recordings of {settings.refit_kinds} kinds."
    )


def sources(found: Sequence[Sequence[Mapping[str, Any]]], count: int) -> list[int]:
    """Return for each bench the one whose causes are fitted to it.

    As a rule the source is the bench itself. Where its own recordings do not suffice to name a
    cause, the source is one of those with the causes named most often. The benches are units of one
    product.
    """
    named = [
        tuple(sorted({effect["name"] for own in passes for effect in own["effects"]}))
        for passes in found
    ]
    told = Counter(causes for causes in named if causes)
    usual = named.index(told.most_common(1)[0][0]) if told else 0
    return [p if p < len(named) and (named[p] or not told) else usual for p in range(count)]


def fitted(reproduction: Reproduction, item: tuple[int, int]) -> dict[str, dict[str, float | str]]:
    """Fit the numbers of the causes to a bench, write its physical model, and return them.

    Args:
        reproduction: Run with the recordings.
        item: The bench, and the one whose causes are taken.
    """
    settings, unit = reproduction.settings, reproduction.units[item[0]]
    named_on = reproduction.units[item[1]]
    source = reproduction.causes or reproduction.model_file(named_on, "diagnosed")
    reproduction.tell(f"  {unit.name}: fitting the numbers of what {source} names")
    part = representative(unit, settings.refit_seconds, settings.refit_kinds)
    model = refit(part, load_model(source))
    write_model(reproduction.model_file(unit, "physical"), model)
    return numbers_of(model)


def numbers_of(model: Model) -> dict[str, dict[str, float | str]]:
    """Return a model's numbers by actuator and effect."""
    named = (model.actuator, *model.effects)
    return {part.name: dict(part.values) for part in named}
