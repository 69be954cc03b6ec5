"""The unit of a virtual bench in the middle of every draw."""

from dataclasses import replace

from tendon_hardware.virtual_bench.physics.constants import (
    LoadCellConstants,
    ServoConstants,
    SliderConstants,
    TendonConstants,
)
from tendon_hardware.virtual_bench.physics.unit import (
    BENCHES,
    BenchUnit,
    LineConstants,
    servo_count,
)


def nominal_unit(bench: str) -> BenchUnit:
    """Return the nominal unit of a bench."""
    servo, tendon, cell = ServoConstants(), TendonConstants(), LoadCellConstants()
    line = LineConstants(servo=servo, tendon=tendon, load_cell=cell)
    if isinstance(BENCHES[bench], SliderConstants):
        tendon = replace(tendon, routing_friction=0.0)
    return BenchUnit(
        bench=bench,
        seed=-1,
        servo=servo,
        tendon=tendon,
        mechanism=BENCHES[bench],
        load_cell=cell,
        further=(line,) * (servo_count(bench) - 1),
    )
