"""Examine a bench before it is used: ports, servo, load cell and clock, with what to do."""

from tendon_hardware.doctor.examination import examine, ports_of
from tendon_hardware.doctor.observation import Observation

__all__ = ["Observation", "examine", "ports_of"]
