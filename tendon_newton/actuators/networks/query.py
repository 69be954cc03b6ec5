"""From a model file's `learned` actuator to something that answers with forces."""

import logging
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import warp as wp

from tendon_newton.actuators.networks.artifact import load_network
from tendon_newton.actuators.networks.fused_query import fused_or_module, module_query
from tendon_newton.actuators.networks.torchscript import ForceQuery
from tendon_newton.data.cards.force_network_card import HoldLaw
from tendon_newton.data.model_file import Model
from tendon_newton.errors import InvalidModelFile, unknown_name

NetworkForm = Literal["torchscript", "fused"]
FORMS: tuple[NetworkForm, ...] = ("torchscript", "fused")

LOG = logging.getLogger(__name__)


def network_file(model: Model) -> Path:
    """Return the file of a model's force network.

    Raises:
        InvalidModelFile: The model names none.
    """
    file = model.actuator.values.get("file")
    if not isinstance(file, str):
        raise InvalidModelFile(
            f"actuator {model.actuator.name!r} needs file, the path of a force network; "
            f"it is {file!r}"
        )
    return Path(file)


def open_query(model: Model, form: str, device: Any, *, trust: bool = False) -> ForceQuery:
    """Load a model's force network for a simulation, and warn of one that was not made for that.

    The form is ``torchscript``, or ``fused`` where there is such a kernel; see `load_network` on
    trust.

    Raises:
        UnknownName: No such form.
    """
    if form not in FORMS:
        raise unknown_name("form of a network", form, FORMS)
    where = str(wp.device_to_torch(wp.get_device(device)))
    file = load_network(network_file(model), trust=trust, device=where)
    if file.card.purpose != "simulation":
        warn_of_purpose(str(file.path))
    return fused_or_module(file, device) if form == "fused" else module_query(file)


@cache
def warn_of_purpose(path: str) -> None:
    """Say once of a file that its network only knows the force along recorded motion."""
    LOG.warning(
        "%s was trained for forces along recordings; for a closed loop train one with "
        "'tendon-newton train-force --purpose simulation'",
        path,
    )


def with_hold(model: Model, hold: HoldLaw) -> Model:
    """Return a model that says how its network's force answers to the shaft.

    What the model file says itself stays.
    """
    law = {"hold_stiffness": hold.stiffness, "hold_damping": hold.damping, "force_scale": 1.0}
    return replace(model, actuator=replace(model.actuator, values={**law, **model.actuator.values}))
