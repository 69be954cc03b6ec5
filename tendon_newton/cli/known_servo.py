"""List the servos that are known, or write one with your own gain and supply.

Without a name each servo is told with what it leaves of logs that no fit has seen. A known servo
stands wherever a model file may, by its name or by the folder that this verb wrote:

  tendon-newton servo xl330 --gain 800 --supply 5 --out mine
  tendon-newton train-policy --force mine --out policy
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.errors import InvalidParameter, look_up


@dataclass(frozen=True, kw_only=True)
class ServoConfig:
    """Which servo, and how yours is set."""

    servo: Annotated[str | None, tyro.conf.Positional] = None  # Name of a known servo.
    out: Path | None = None  # Folder for a servo of your settings; made if it is not there.
    gain: float | None = None
    """Position gain in your servo's register; by default the factory's, or that of the folder."""
    supply: float | None = None  # Your supply [V]; a recording's own column counts more.


def main(config: ServoConfig) -> None:
    """List, show or write."""
    from tendon_newton.diagnosis.diagnosed_bench import model_path
    from tendon_newton.diagnosis.known_servos import known_servo, known_servos, told, write_servo

    if config.servo is None:
        print("\n".join(f"{name:10s} {told(home)}" for name, home in known_servos().items()))
        return
    home = known_servo(config.servo) or look_up("servo", config.servo, known_servos())
    print(f"{config.servo}: {told(home)}\n  {model_path(home)}")
    if config.out is None:
        if config.gain is not None or config.supply is not None:
            raise InvalidParameter("--gain and --supply need --out, the folder that gets them")
        return
    write_servo(home, make_folder(config.out, home), gain=config.gain, supply=config.supply)
    print(f"wrote {config.out}: name it wherever a model file or a known servo may stand")
