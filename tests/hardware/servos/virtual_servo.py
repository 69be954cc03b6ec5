"""A driver on an emulated bus that runs as fast as it can."""

from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_hardware.virtual_bench import FaultEvent, LockstepBench
from tendon_hardware.virtual_bench.emulation.emulations import SERVO_MODELS
from tendon_hardware.virtual_bench.physics.unit import draw_unit

TICK = 0.0125  # Period of a loop at 80 Hz [s]
LOOP = HostPositionLoop(gain=6.0, offset=0.0)
"""Stiff enough to hold a spring to some hundredths of a radian."""


class VirtualServo:
    """A bench and its driver, configured and switched on, without duty."""

    def __init__(self, bench: str = "finger", servo: str = "xc330_t288_t") -> None:
        self.bench = LockstepBench(draw_unit(bench, 3, servo), model=SERVO_MODELS[servo])
        self.clock = self.bench.clock
        self.servo = BusServo(SERVOS[servo], self.bench.servo_port(), clock=self.clock)
        self.servo.open()
        self.servo.configure()
        self.servo.enable_torque()

    def run(self, command: float, seconds: float, loop: HostPositionLoop = LOOP) -> list:
        """Command an angle [rad] at 80 Hz for a time [s] and return the states."""
        states = []
        end = self.clock.now() + seconds
        while self.clock.now() < end:
            states.append(self.servo.read_state())
            self.servo.command_duty(loop.duty(command, states[-1].position))
            self.wait(TICK)
        return states

    def wait(self, seconds: float) -> None:
        """Let time pass without an instruction."""
        self.clock.sleep_until(self.clock.now() + seconds)

    def let(self, name: str, **words) -> None:
        """Let a mishap happen now."""
        self.bench.plan(FaultEvent(name=name, start=self.clock.now(), **words))
        self.wait(2e-3)

    def register(self, address: int) -> int:
        """Look into the servo's memory."""
        return self.bench.plant.registers.value(address)

    def corrupt(self, address: int, counts: int) -> None:
        """Change the servo's memory behind the driver's back."""
        self.bench.plant.registers.store(address, counts)
