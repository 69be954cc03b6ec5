"""Rates of faults of a finger between two strings: ``python -m tests.planted.two_strings OUT``."""

from tests.planted.owners.rates import main
from tests.planted.two_strings.bench import TWO_STRINGS

if __name__ == "__main__":
    main(TWO_STRINGS)
