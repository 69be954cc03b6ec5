"""From recordings and a model to named causes: find a gap, name it, extend, measure the gain.

`diagnose` is the whole way. `diagnosis.search.decide.find_causes` looks for causes and decides,
`evaluation` measures the gain on held-out recordings, `posterior` keeps what is left open,
`reporting` and `accounts` tell it. `in_time` compares days, `next_experiment` designs a next run.
"""
