"""Rates of faults of a finger between two strings: ``python -m lab.exams.two_strings OUT``."""

from lab.exams.owner_rates import main
from tests.planted.two_strings.bench import TWO_STRINGS

if __name__ == "__main__":
    main(TWO_STRINGS)
