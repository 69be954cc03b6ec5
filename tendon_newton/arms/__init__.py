"""Arms of many servos: what their posture does to each of them, and all of them at once."""
