"""Types in which the device code of a written drive runs."""

import warp as wp

from tendon_newton.exports.runtime.facts import MEMORY_SIZE, PARAMETERS

real = wp.float64
Jet = wp.types.vector(length=3, dtype=real)
Values = wp.types.vector(length=5, dtype=real)
MemoryVector = wp.types.vector(length=MEMORY_SIZE, dtype=real)
ParameterVector = wp.types.vector(length=len(PARAMETERS), dtype=real)
DeviceArray, DeviceGrid, DeviceBlock = wp.array, wp.array2d, wp.array3d
