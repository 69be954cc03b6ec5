r"""Friction of a gear by the loads on both of its sides, as friction by one of them.

A gear that loses :math:`c_m |F_m| + c_e F` and a friction :math:`C` gives, at a constant speed on
the side :math:`s = \pm 1`,

.. math:: F = \frac{(1 - s c_m) F_m - s C}{1 + s c_e}
    = \frac{g F_m - s C'}{1 + s \mu}, \quad
    \mu = \frac{c_m + c_e}{1 + c_m c_e}, \quad g = \frac{1 - c_m^2}{1 + c_m c_e}

since :math:`(1 + s c_m)(1 + s c_e) = (1 + c_m c_e)(1 + s \mu)`: `load_dependent_friction` of
:math:`\mu` on a motor whose force is :math:`g` times as large. Both hold for winding in and for
winding out; :math:`C' = C (1 + s c_m) / (1 + c_m c_e)` is :math:`C / (1 + c_m c_e)` in the mean of
the two. With :math:`c_m = c_e = K` it is `gear_load_friction`.
"""


def quasi_static_gear(motor: float, load: float) -> tuple[float, float]:
    """Return what friction by both sides' load amounts to beside friction by the output's load.

    Args:
        motor: c_m, friction by what the motor presses the gear's teeth with [1].
        load: c_e, friction by what the tendon presses them with [1].

    Returns:
        Coefficient mu and gain g [1].
    """
    both = 1.0 + motor * load
    return (motor + load) / both, (1.0 - motor * motor) / both
