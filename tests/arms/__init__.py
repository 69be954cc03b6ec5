"""Arms of many servos."""
