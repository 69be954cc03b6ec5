"""What drives a real finger from a Raspberry Pi, or one that is not there through the same code.

``servos`` and ``load_cells`` talk to the hardware, ``doctor`` examines it, ``collect`` records it,
and ``virtual_bench`` stands in for it. Nothing here loads the simulator.
"""
