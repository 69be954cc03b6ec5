"""A line in two elastic halves with a guide between them: stretch, slack and capstan friction."""

from math import exp

from tendon_hardware.virtual_bench.physics.constants import TendonConstants


class BenchTendon:
    r"""Tension from what the spool has wound in and what the mechanism has given.

    .. math::
        F = k_a \max(0, a - s), \quad T = k_b \max(0, s - l), \qquad
        e^{-\phi} \le F / T \le e^{\phi}

    ``a`` is the line wound in less the slack [m], ``l`` the mechanism's excursion [m] and ``s`` how
    far the line has come through the guide [m]. The line slips there only as far as keeps the ratio
    of the two tensions within the capstan bound. The guide holds any tension between its bounds,
    with no rate and no creep. The load cell sits before the guide and measures ``F``.

    Source: Euler-Eytelwein, for a limp line without mass.
    """

    __slots__ = ("_ka", "_kb", "_ratio", "_slack", "mechanism_side", "passed", "spool_side")

    def __init__(self, constants: TendonConstants) -> None:
        self._ka = constants.spool_side_stiffness
        self._kb = constants.mechanism_side_stiffness
        self._ratio = exp(constants.guide_friction + constants.routing_friction)
        self._slack = constants.slack
        self.passed = 0.0  # [m] s
        self.spool_side = 0.0  # [N] F
        self.mechanism_side = 0.0  # [N] T

    @property
    def mechanism_side_stiffness(self) -> float:
        """Stiffness that the mechanism feels while taut [N/m]."""
        return self._kb

    def settle(self, wound: float, excursion: float) -> None:
        """Find the line's place at the guide and both tensions.

        Args:
            wound: Line on the spool [m].
            excursion: Line that the mechanism has given [m].
        """
        a, s = wound - self._slack, self.passed
        if a <= excursion:  # slack: the guide just lets it hang
            self.passed = a if s < a else excursion if s > excursion else s
            self.spool_side = self.mechanism_side = 0.0
            return
        ka, kb, ratio = self._ka, self._kb, self._ratio
        before = ka * (a - s)
        after = kb * (s - excursion)
        if before > ratio * after:  # slips toward the spool
            s = (ka * a + ratio * kb * excursion) / (ka + ratio * kb)
        elif after > ratio * before:
            s = (kb * excursion + ratio * ka * a) / (kb + ratio * ka)
        else:
            self.spool_side, self.mechanism_side = before, after
            return
        self.passed = s
        self.spool_side = ka * (a - s)
        self.mechanism_side = kb * (s - excursion)
