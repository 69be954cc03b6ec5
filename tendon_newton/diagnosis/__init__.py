"""From recordings and a model to named causes: detect a gap, attribute it, extend the model, measure the gain."""
