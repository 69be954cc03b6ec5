"""From a mechanism, an actuator and a list of effects to trajectories, for many worlds at once."""
