"""The servos that ship: identified from published logs, and held to logs left out."""
