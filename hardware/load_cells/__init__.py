"""Load cells by name: each sends raw counts, which a calibration turns into newtons later."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from hardware.load_cells.base import LoadCell
from hardware.load_cells.hx711_gpio import Hx711Gpio
from hardware.load_cells.hx711_serial import Hx711Serial

LOAD_CELLS: Mapping[str, Callable[[str], LoadCell]] = MappingProxyType(
    {
        "hx711_serial": Hx711Serial,
        "hx711_gpio": Hx711Gpio.from_pins,
    }
)
"""Each makes a load cell from the word behind ``--load-cell-port``."""
