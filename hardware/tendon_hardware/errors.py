"""Errors of the bench, named as facts: what was promised, what came, where."""

from tendon_newton.errors import TendonNewtonError


class HardwareFault(TendonNewtonError):
    """Base of everything that a bench can do wrong."""


class PortUnavailable(HardwareFault):
    """A serial port is not there, or may not be opened."""


class PortBusy(HardwareFault):
    """Another process holds a serial port."""


class PortLost(HardwareFault):
    """A serial port that was open is gone: the adapter was unplugged."""


class ServoSilent(HardwareFault):
    """A servo gave no whole answer in all attempts."""


class ServoRefused(HardwareFault):
    """A servo answered an instruction with an error."""


class ServoAlert(HardwareFault):
    """A servo reports a hardware error and may have shut its motor down."""


class ServoReset(HardwareFault):
    """A servo has started anew: it forgot its RAM and gives no torque."""


class WatchdogTripped(HardwareFault):
    """A servo stopped because no instruction came in time; it takes no goals until cleared."""


class MotorStillDriven(HardwareFault):
    """A motor that was switched off pulls on."""


class UnsupportedServo(HardwareFault):
    """The servo on the bus is not the one that was expected."""


class SettingMismatch(HardwareFault):
    """A servo's register reads back other than it was set."""


class CommandNotFinite(HardwareFault):
    """A command is no number."""


class LoadCellSilent(HardwareFault):
    """A load cell sends nothing, or nothing that can be read."""


class BallNotSeen(HardwareFault):
    """A ball is to be turned, and no camera sees it."""


class InvalidCalibration(HardwareFault):
    """A calibration, or its file, breaks what is promised of it."""


class LogNotWritten(HardwareFault):
    """The disk takes no more of a log."""


class PolicyMismatch(HardwareFault):
    """A policy was trained for another bench than the one that it should drive."""


class SafetyStop(HardwareFault):
    """A limit of the bench was passed, and the motor was switched off."""


class RuleOutOfReach(HardwareFault):
    """A safety rule's limit lies beyond what its sensor can say: it could never act."""


class PolicyFailure(HardwareFault):
    """A policy, or what estimates the tension beside it, could not be run."""


class SharedIdentifier(HardwareFault):
    """Two servos on a bus answer to one ID."""
