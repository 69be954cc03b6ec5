"""A bench that is not there: a servo and a load cell behind real serial protocols.

``open_virtual`` starts one as a process with two ports; ``lockstep_of`` runs one faster than
real time.
"""

from tendon_hardware.virtual_bench.faults import FaultEvent, Faults
from tendon_hardware.virtual_bench.lockstep import LockstepBench
from tendon_hardware.virtual_bench.physics.constants import BENCH_SEEDS
from tendon_hardware.virtual_bench.process import VirtualPorts, lockstep_of, open_virtual

__all__ = [
    "BENCH_SEEDS",
    "FaultEvent",
    "Faults",
    "LockstepBench",
    "VirtualPorts",
    "lockstep_of",
    "open_virtual",
]
