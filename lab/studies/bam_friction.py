"""What Rhoban/bam's own program makes of load on a gear.

``python -m lab.studies.bam_friction`` needs Python 3.12 with ``better-actuator-models`` and
nothing else of this repository. Writes tests/physics/servos/bam_friction.json: for motor torques,
speeds and directions the torque at which the program's model neither speeds up nor slows down. At
no speed those are the two ends of what sticks. Tests compare the effects with it.
"""

import importlib
import json
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

TORQUES = (-9.0, -0.4, 0.05, 2.0, 15.0)  # Torques of the motor [N m]
SPEEDS = (0.0, 0.3, 1.5, 8.0)  # [rad/s]
LAWS: dict[str, tuple[str, dict[str, float]]] = {
    # XL330 and MX106 as published, their exponent replaced by Stribeck's 2, no friction but load's
    "gear": ("m3", {"load_friction_base": 0.1217}),
    "strong_gear": ("m3", {"load_friction_base": 0.45}),
    "breakaway": (
        "m4",
        {"load_friction_base": 0.068, "load_friction_stribeck": 0.0738, "dtheta_stribeck": 2.558},
    ),
    "strong_breakaway": (
        "m4",
        {"load_friction_base": 0.0092, "load_friction_stribeck": 0.2224, "dtheta_stribeck": 1.623},
    ),
    "both_sides": ("m5", {"load_friction_motor": 0.2897, "load_friction_external": 0.158}),
}
"""Name -> variant and its numbers; all others are zero."""
RESULT = Path(__file__).parents[2] / "tests" / "physics" / "servos" / "bam_friction.json"
WIDEST = 100.0  # Torque [N m] beyond which none of these balances


def main() -> None:
    """Write the table."""
    rows = [
        [law, *case, balance(model_of(*LAWS[law]), *case)]
        for law, *case in product(LAWS, TORQUES, SPEEDS, (1.0, -1.0))
    ]
    head = {
        "command": "python -m lab.studies.bam_friction",
        "program": f"better-actuator-models {version('better-actuator-models')}",
        "laws": {name: numbers for name, (_, numbers) in LAWS.items()},
        "columns": ["law", "motor [N m]", "speed [rad/s]", "direction", "output [N m]"],
    }
    lines = ",\n".join(json.dumps(row) for row in rows)
    text = f'{json.dumps(head, indent=1)[:-2]},\n "rows": [\n{lines}\n]}}\n'
    RESULT.write_text(text, encoding="utf-8")


def model_of(variant: str, numbers: dict[str, float]) -> Any:
    """Return the program's model with some of its numbers, and zero for the others."""
    bam: Any = importlib.import_module("bam.model")
    actuators: Any = importlib.import_module("bam.actuators")
    model = bam.models[variant]()
    model.set_actuator(actuators.actuators["xl330"]())
    for name, parameter in model.get_parameters().items():
        if "friction" in name:
            parameter.value = 0.0
    values = numbers | ({"alpha": 2.0} if model.stribeck else {})
    for name, value in values.items():
        getattr(model, name).value = value
    return model


def balance(model: Any, motor: float, speed: float, direction: float) -> float:
    """Return the torque [N m] that the load takes off at a constant speed, by bisection."""
    low, high = -WIDEST, WIDEST
    for _ in range(200):
        output = 0.5 * (low + high)
        loss, viscous = model.compute_frictions(motor, -output, direction * speed)
        if motor - output - direction * (loss + viscous * speed) > 0.0:
            low = output
        else:
            high = output
    return 0.5 * (low + high)


if __name__ == "__main__":
    main()
