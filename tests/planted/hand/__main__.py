"""Rates of faults of a hand's fingers: ``python -m tests.planted.hand OUT``."""

from tests.planted.hand.bench import HAND
from tests.planted.owners.rates import main

if __name__ == "__main__":
    main(HAND)
