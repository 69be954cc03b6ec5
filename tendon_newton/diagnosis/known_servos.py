"""Servos that ship with the program, each the folder of a diagnosis: a name in place of a file.

A folder of ``assets/servos``, or of ``servos`` in a folder of the user's assets, is a known servo,
and so is any folder with its evidence.
Its numbers come from a stand on which it turned a shaft. Whoever names it gets the servo alone, as
the spool of another bench has it; the stand's own numbers stay in the folder.
"""

from dataclasses import replace
from pathlib import Path

from tendon_newton.actuators import ACTUATORS, find_actuator
from tendon_newton.data.files.checked_table import CheckedTable, read_checked
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.files.together import KEY as HASHES
from tendon_newton.data.files.together import together
from tendon_newton.data.model_file import Model, NamedValues, load_model, write_model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.diagnosis.diagnosis_file import ANSWER, MODEL, PROMISE
from tendon_newton.diagnosis.posterior import ENDING
from tendon_newton.effects import EFFECTS, law_of
from tendon_newton.errors import InvalidDiagnosis, InvalidModelFile, InvalidParameter
from tendon_newton.mechanisms.asset_library import asset_folders
from tendon_newton.simulation.model.parameter_table import spool_radius_of

FOLDER = "servos"
EVIDENCE = "evidence.json"


def known_servos() -> dict[str, Path]:
    """Return the folder of every known servo by its name; a user's own stands for ours."""
    homes = [home for folder in asset_folders() for home in sorted((folder / FOLDER).glob("*"))]
    return {home.name: home for home in homes if (home / MODEL).is_file()}


def known_servo(path: str | Path) -> Path | None:
    """Return the folder of a known servo, named by a word, by its folder or by a file in that.

    None for another word, and for a file or folder of that name without the evidence.
    """
    path = Path(path)
    if path.exists():
        home = path if path.is_dir() else path.parent
        return home if (home / EVIDENCE).is_file() else None
    return known_servos().get(str(path))


def told(home: Path) -> str:
    """Return what a known servo leaves of logs that no fit has seen, in words."""
    if not (home / EVIDENCE).is_file():
        return "no evidence beside it"
    told = evidence_of(home)
    low, high = told.pair("gains")
    return (
        f"{told.number('held_out_mrad'):.1f} mrad held out at {told.word('held_out')}, fitted to "
        f"{told.word('fitted')}; logs of {low:g} to {high:g}, up to {told.number('load_nm'):g} N m"
    )


def write_servo(home: Path, out: Path, *, gain: float | None, supply: float | None) -> None:
    """Write a known servo with a user's own settings.

    Args:
        home: Its folder.
        out: Folder of the user's own.
        gain: Position gain in the servo's own register [1]; None keeps the model's.
        supply: Supply [V]; None keeps the model's.

    Raises:
        InvalidParameter: A setting is not above zero, or nothing says what a gain does.
    """
    model = load_model(home / MODEL)
    values = dict(model.actuator.values)
    for name, value in (("gain", gain), ("supply", supply)):
        if value is not None and not value > 0.0:
            raise InvalidParameter(f"--{name} must be above 0; it is {value:g}")
    if gain is not None:
        values["duty_per_rad"] = gain * evidence_of(home).number("duty_per_gain")
    if supply is not None:
        values["supply_voltage"] = supply
    for number in find_actuator(model.actuator.name).parameters:
        told = values.get(number.name, number.nominal)
        if isinstance(told, float) and not number.lower <= told <= number.upper:
            raise InvalidParameter(
                f"{number.name} of {home.name} must be between {number.lower:g} and "
                f"{number.upper:g} {number.unit}; it would be {told:g}"
            )
    worlds = Path(ANSWER).with_suffix(ENDING).name
    beside = {file: (home / file).read_text(encoding="utf-8") for file in (EVIDENCE, worlds)
              if (home / file).is_file()}  # fmt: skip
    answer = read_checked(home / ANSWER, InvalidDiagnosis, PROMISE).values
    with together():  # without the hash of the model as it was
        write_model(out / MODEL, replace(model, actuator=replace(model.actuator, values=values)))
        write_json(out / ANSWER, {key: value for key, value in answer.items() if key != HASHES})
        for file, text in beside.items():
            write_text(out / file, text)


def evidence_of(home: Path) -> CheckedTable:
    """Read where a known servo comes from."""
    promise = "what a known servo rests on is a JSON file"
    return read_checked(home / EVIDENCE, InvalidDiagnosis, promise)


def servo_alone(model: Model, radius: float) -> Model:
    """Return the servo of a model of a stand, without the stand, on another spool.

    Args:
        model: Model of a stand whose shaft has a spool as large as its model states [m].
        radius: Radius of the other spool [m]; a shaft counts as 1 m.
    """
    ratio = radius / stated_radius(model)
    values = {**on_spool(model.actuator, ratio).values, "spool_radius": radius}
    if isinstance(limit := values.get("force_limit"), float):
        values["force_limit"] = limit / ratio
    own = {parameter.name for parameter in find_actuator(model.actuator.name).parameters}
    return Model(
        actuator=NamedValues(name=model.actuator.name, values=values),
        effects=tuple(on_spool(e, ratio) for e in model.effects if is_of_servo(e.name, ratio)),
        fit=tuple(name for name in model.fit if name in own),
        tolerances={
            name: tolerance
            for name, tolerance in model.tolerances.items()
            if name in own or (name in EFFECTS and is_of_servo(name, ratio))
        },
    )


def stated_radius(model: Model) -> float:
    """Return the radius of the spool at which a known servo was identified [m].

    Raises:
        InvalidModelFile: The model does not say it.
    """
    if (radius := spool_radius_of(model)) is None:
        raise InvalidModelFile(
            "the model of a known servo must state the spool_radius of its stand, 1.0 for a shaft; "
            "there is none"
        )
    return radius


def is_of_servo(owner: str, ratio: float) -> bool:
    """Tell whether numbers of an owner are the servo's, and neither its stand's nor a sensor's.

    What a shaft has between gear and load, such as play, goes to another shaft alone: a string
    under tension closes the gap, and gives more.
    """
    sides = ("actuator", "transmission") if ratio == 1.0 else ("actuator",)
    return owner in ACTUATORS or (owner != "bench" and law_of(owner).side in sides)


def on_spool(part: NamedValues, ratio: float) -> NamedValues:
    """Return an actuator or an effect whose force pulls at a spool so many times as large."""
    values = {
        name: value if isinstance(value, str) else value * factor(part.name, name, ratio)
        for name, value in part.values.items()
    }
    return replace(part, values=values)


def factor(owner: str, name: str, ratio: float) -> float:
    """Return how large a number is on a spool so many times as large [1]: a torque stays one."""
    law = ACTUATORS[owner] if owner in ACTUATORS else law_of(owner)
    scale = BenchScale(force=1.0 / ratio, travel=ratio, turn=1.0 / ratio)
    unit = next((p.unit for p in law.parameters if p.name == name and not p.absolute), "1")
    return scale.factor(unit)
