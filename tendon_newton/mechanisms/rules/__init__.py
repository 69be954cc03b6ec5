"""Rules that a stage must keep to be a mechanism; each violation names its prim."""
