"""Serve a virtual bench: ``python -m hardware.virtual_bench --folder FOLDER``."""

from hardware.virtual_bench.server import main

main()
