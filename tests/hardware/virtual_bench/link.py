"""The real SDK on a virtual bench, in lockstep."""

from dataclasses import replace
from typing import Any

from tendon_hardware.virtual_bench import LockstepBench
from tendon_hardware.virtual_bench.memory.control_table import XC330_T288_T
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
    draw_unit,
    servo_count,
)

ID = 1
SUCCESS, SILENT, BROKEN = 0, -3001, -3002
TORQUE, MODE, PWM_GOAL, POSITION = 64, 11, 100, 132
EXTENDED, PWM = 4, 16


class Link:
    """A lockstep bench and the SDK's handlers for its servo."""

    def __init__(self, bench: str = "finger", seed: int = 0, **options: Any) -> None:
        from dynamixel_sdk import PacketHandler

        unit = draw_unit(bench, seed, options.get("model", XC330_T288_T).name)
        self.bench = LockstepBench(unit, **options)
        self.port = self.bench.servo_port()
        self.sdk = PacketHandler(2.0)
        assert self.port.setBaudRate(1_000_000)

    def read(self, address: int, size: int) -> int:
        """Return a register that must answer, unsigned."""
        value, result, error = self.sdk.readTxRx(self.port, ID, address, size)
        assert (result, error) == (SUCCESS, 0)
        return int.from_bytes(bytes(value), "little")

    def write(self, address: int, size: int, value: int) -> int:
        """Write a register and return the servo's error."""
        data = list((value & ((1 << 8 * size) - 1)).to_bytes(size, "little"))
        result, error = self.sdk.writeTxRx(self.port, ID, address, size, data)
        assert result == SUCCESS
        return error

    def ping(self) -> tuple[int, int, int]:
        """Return model, result and error."""
        return self.sdk.ping(self.port, ID)

    def enable(self, mode: int) -> None:
        """Choose a mode and switch the torque on."""
        assert self.write(TORQUE, 1, 0) & 0x7F == 0
        assert self.write(MODE, 1, mode) == 0
        assert self.write(TORQUE, 1, 1) == 0

    def wait(self, duration: float) -> None:
        """Let time pass [s]."""
        clock = self.bench.clock
        clock.sleep_until(clock.now() + duration)

    def lines(self, duration: float) -> list[tuple[float, bytes]]:
        """Return what the load cell sends in a while [s], with arrivals [s]."""
        stream = self.bench.load_cell_stream()
        stream.open()
        self.wait(duration)
        return stream.receive()


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
