"""Motor, gear, tendon and mechanism of the virtual bench."""
