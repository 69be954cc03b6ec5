"""Rates of faults of a hand's fingers: ``python -m lab.exams.hand OUT``."""

from lab.exams.owner_rates import main
from tests.planted.hand.bench import HAND

if __name__ == "__main__":
    main(HAND)
