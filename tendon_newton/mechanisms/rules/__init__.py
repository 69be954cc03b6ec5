"""What a stage must hold to be a mechanism, each violation with its prim."""
