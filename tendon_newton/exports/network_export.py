"""The force network of a learned actuator as a file for programs without torch."""

from pathlib import Path
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model

NETWORK_FILE = "network.onnx"


def exported_network(folder: Path, model: Model) -> tuple[dict[str, Any] | None, Model]:
    """Write a model's force network as ONNX, if it has one.

    Returns:
        What a program must know to ask it (file, how often [Hz], window), and the model with the
        hold law of its card.

    Raises:
        InvalidNetworkFile: The network's file is damaged.
        UntrustedNetworkFile: It is a program that the user has not said to trust.
    """
    if not find_actuator(model.actuator.name).held:
        return None, model
    from tendon_newton.actuators.networks.artifact import load_network
    from tendon_newton.actuators.networks.onnx_file import write_onnx
    from tendon_newton.actuators.networks.query import network_file, with_hold
    from tendon_newton.force_networks.weights_file import network_of_weights

    file = load_network(network_file(model))
    card = file.card
    network = network_of_weights(file.path.read_bytes(), card)
    write_onnx(folder / NETWORK_FILE, network, card)
    asked = (card.rate, card.window)
    return {"file": NETWORK_FILE, "asked": asked}, with_hold(model, card.hold)
