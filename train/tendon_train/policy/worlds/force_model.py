"""Force models of a training: the ideal source, a model file, or a force network."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from tendon_newton.actuators.networks.artifact import load_network
from tendon_newton.actuators.networks.query import network_file
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.files.text_file import read_bytes
from tendon_newton.data.model_file import Model, NamedValues, load_model
from tendon_newton.diagnosis.diagnosed_bench import model_path, open_model
from tendon_newton.diagnosis.known_servos import evidence_of, known_servo
from tendon_newton.effects import Stage, law_of
from tendon_newton.errors import InvalidModelFile
from tendon_newton.force_networks.weights_file import SUFFIX
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

IDEAL = "ideal"
NETWORKS = (SUFFIX, ".pt")  # Endings of force networks; all else is a model
IDEAL_GAIN = 4.2  # Gain of the ideal source [N/rad]; Yuryev and Hughes (2026), section II-E


@dataclass(frozen=True, kw_only=True)
class ForceModel:
    """Actuator and effects of a training, and where they come from."""

    name: str  # The ideal source, or a file's name
    model: Model
    sha256: str | None  # Hash of the model file, where there is one
    files: Mapping[str, str]  # Name -> SHA-256 of each file that was read
    servo: str | None = None  # Kind of the servo, where a known one says it

    def __post_init__(self) -> None:
        object.__setattr__(self, "files", MappingProxyType(dict(self.files)))


def open_force_model(force: str, mechanism: Mechanism) -> ForceModel:
    """Return the actuator and the effects that a word or a file names.

    Effects that change nothing but what a load cell or a log's clock reads are left out: a policy
    sees neither.

    Args:
        force: ``ideal``, a model file, a diagnosis (its folder), a known servo, or a force network
            (``.pt``).
        mechanism: Its spool is wound by the ideal source and by a network without a model file.

    Raises:
        InvalidModelFile: The file is no model.
        InvalidParameter: The diagnosis is of another bench.
    """
    radius = mechanism.tendons[0].spool_radius
    if force == IDEAL:
        ideal = NamedValues(name="ideal", values={"gain": IDEAL_GAIN, "spool_radius": radius})
        return ForceModel(name=IDEAL, model=Model(actuator=ideal), sha256=None, files={})
    path = Path(force)
    if path.suffix in NETWORKS:
        values = {"file": str(path.resolve()), "spool_radius": radius}
        model = Model(actuator=NamedValues(name="learned", values=values))
        return ForceModel(name=path.name, model=model, sha256=None, files=hashes(path))
    if path.suffix == ".onnx":
        raise InvalidModelFile(
            f"{path}: an ONNX file is for deployments; a training takes the .safetensors beside it"
        )
    home = known_servo(path)
    servo = home and evidence_of(home).values.get("servo")
    model = open_model(path, [mechanism])
    path = model_path(path)
    files = hashes(path, *([network_file(model)] if "file" in model.actuator.values else []))
    kept = tuple(effect for effect in model.effects if moves_finger(effect.name))
    return ForceModel(
        name=path.name,
        model=replace(model, effects=kept),
        sha256=files[path.name],
        files=files,
        servo=servo,
    )


def trust_force(force: str) -> None:
    """Trust the force network that a training names, if it names one, from now on."""
    path = Path(force)
    if force == IDEAL:
        return
    if path.suffix not in NETWORKS:
        model = load_model(model_path(path))
        if "file" not in model.actuator.values:
            return
        path = network_file(model)
    load_network(path, trust=True)


def moves_finger(effect: str) -> bool:
    """Tell whether an effect changes more than what a load cell or a log's clock reads."""
    found = law_of(effect)
    return not found.acts_on_cell_only() and found.hook(Stage.PERIOD) is None


def hashes(*paths: Path) -> dict[str, str]:
    """Return the SHA-256 of files by name.

    Raises:
        InvalidModelFile: One cannot be read.
    """
    promise = "the force of a training must be a file that can be read"
    return {p.name: content_hash(read_bytes(p, InvalidModelFile, promise)) for p in paths}
