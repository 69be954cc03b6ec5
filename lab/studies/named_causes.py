"""The causes that a diagnosis names, in words, for the scripts beside this file."""

from collections.abc import Sequence

from tendon_newton.diagnosis.result import Diagnosis


def cause_lines(diagnosis: Diagnosis, *, mean_absolute: bool = False) -> Sequence[str]:
    """Return a line per cause: numbers with 95 % intervals, and the held-out error without it.

    Args:
        diagnosis: What names them.
        mean_absolute: Whether the error of the angle is its mean size, and not its RMS.
    """
    lines = []
    for effect in diagnosis.effects:
        numbers = ", ".join(
            f"{name} {e.value:.4g} [{e.ci95[0]:.4g}, {e.ci95[1]:.4g}] {e.unit}"
            for name, e in effect.parameters.items()
        )
        errors = effect.without
        without = 1e3 * (errors.theta_mae if mean_absolute else errors.theta_rmse)
        rivals = f"; not told from {', '.join(effect.indistinguishable_from)}"
        lines.append(
            f"  {effect.name}: {numbers}; without it {without:.1f} mrad"
            f"{rivals if effect.indistinguishable_from else ''}"
        )
    return lines
