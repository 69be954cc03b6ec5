"""What a reader must not believe too firmly: numbers that the data did not pin down."""

from collections.abc import Iterator, Mapping

from tendon_newton.diagnosis.explanation import Estimate
from tendon_newton.diagnosis.report_words import cause_text
from tendon_newton.diagnosis.result import Diagnosis


def doubts(diagnosis: Diagnosis) -> list[str]:
    """Return a sentence for each number at a bound, without a bound, or tied to another."""
    sentences: list[str] = []
    if diagnosis.start:
        known = "; ".join(cause_text(*cause, diagnosis.scale) for cause in diagnosis.start.items())
        sentences.append(
            f"Already in the model that was started from: {known}. Errors before are with them, "
            "and no cause names them again."
        )
    for owner, numbers in groups(diagnosis):
        for name, estimate in numbers.items():
            label = f"{plain(owner)}: {plain(name)}"
            if estimate.flat:
                sentences.append(
                    f"{label} is open: its interval is as wide as the range that it may have. "
                    "This data say that the effect is there, not how large this number is."
                )
            elif estimate.at_bound:
                sentences.append(
                    f"{label} ended at the edge of its range. Something that the range rules out "
                    "fits better: look for another cause before relying on it."
                )
    for pair in diagnosis.confounded:
        way = "grows with" if pair.correlation > 0.0 else "shrinks as the other grows:"
        sentences.append(
            f"{plain(pair.first)} {way} {plain(pair.second)} (correlation of their errors "
            f"{pair.correlation:.2f}): the data know a combination of the two better than either. "
            "Use them together, as fitted."
        )
    return sentences


def groups(diagnosis: Diagnosis) -> Iterator[tuple[str, Mapping[str, Estimate]]]:
    """Yield every owner of fitted numbers with its numbers."""
    for effect in diagnosis.effects:
        yield effect.name, effect.parameters
    yield diagnosis.model.actuator.name, diagnosis.fitted


def plain(name: str) -> str:
    """Return a name as words."""
    return name.replace(".", ": ").replace("_", " ")
