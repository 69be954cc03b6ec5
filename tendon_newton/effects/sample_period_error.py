"""The log's clock is not the time."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class SamplePeriodError(Effect):
    r"""Rows lie further apart, or closer, than their time stamps say.

    .. math:: \mathrm{d}t = s\,\mathrm{d}t_{log}

    Source: loops that count periods instead of reading a clock: 80 Hz written down as 12 ms.
    Validity: one factor for the whole log; a clock that jumps is a defect of the log.
    Signature: every transient is too slow or too fast by one factor, and what is static fits.
    Confused with: joint_damping_error and viscous_friction on one speed; a bench with a resonance,
    or a delay that is known, tells.
    """

    side = "sensor"
    confused = ("viscous_friction", "joint_damping_error")
    parameters = (
        Parameter("scale", "1", null=1.0, nominal=1.0, lower=0.8, upper=1.25).since(
            "a clock that is off by more than a quarter is seen without a model"
        ),
    )

    @staticmethod
    def period(scale: real, values: Values) -> real:
        """Seconds per second of the log's clock."""
        return scale * values[0]
