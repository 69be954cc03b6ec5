"""Rollouts that can be differentiated, by every number that went in.

`differentiable` is the class that users call, `trajectory_gradient` the same as a step of a torch
program. `taped_run` has the arrays, the start and the readings, `substep_plan` divides recordings
into substeps, and `substep_chain` walks them there and back by the kernels of `substep_kernels`.
Warp differentiates law and effects line by line; `gradient_rules` has what is known by reasoning in
place of that, such as the constrained solve. `network_course` is a run with a force network inside.
"""
