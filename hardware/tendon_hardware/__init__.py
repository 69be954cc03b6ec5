"""Programs for a finger on a Raspberry Pi, real or virtual, through the same code.

``servos`` and ``load_cells`` talk to the hardware, ``doctor`` examines it, ``collect`` records it,
and ``virtual_bench`` stands in for it. Nothing here loads the simulator.
"""
