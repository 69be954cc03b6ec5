"""Load cells: lines, clocks, calibrations and the microcontroller's program."""
