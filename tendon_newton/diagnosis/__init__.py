"""From recordings and a model to named causes: find a gap, name it, extend, measure the gain."""
