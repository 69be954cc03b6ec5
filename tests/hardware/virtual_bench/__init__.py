"""The virtual bench: protocol, plant, faults, process."""
