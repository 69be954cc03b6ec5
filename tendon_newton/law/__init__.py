r"""The law of a tendon: one text of servo, gear, string and spool, which every engine carries.

    clock -> error -> duty -> [actuator] -> [servo's limit] -> motor force -> spool force -> tension
          -> [a string cannot push] -> transmission -> mechanism
    mechanism -> radius -> stretch -> angle -> error

Each name without brackets is a slot for effects (`tendon_newton.effects.base.Stage`); a kernel
holds only those that its model lists. An effect's function `tension` is called here as
`tension_effects`; `device_code.slots` has all slots. Forces travel as jets, so that an integrator
gets the derivatives it needs without finite differences.

What stands here knows a `Tendon` or a `Joint` and the model's numbers, never an engine: the kernels
of the simulation and their adjoint bind it, and exported programs carry it as text.
"""
