"""Load cells by name: each sends raw counts, which a calibration turns into newtons later."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.load_cells.load_cell_type import LoadCell

LOAD_CELLS: Mapping[str, Callable[[str], LoadCell]] = MappingProxyType(
    {"hx711_serial": Hx711Serial}
)
"""Each makes a load cell from the word behind ``--load-cell-port``."""
