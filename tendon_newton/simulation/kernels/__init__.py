"""The kernels that are launched: rollouts, control steps and readings."""
