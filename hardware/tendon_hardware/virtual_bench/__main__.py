"""Serve a virtual bench: ``python -m tendon_hardware.virtual_bench --folder FOLDER``."""

from tendon_hardware.virtual_bench.server import main

main()
