"""Results that pages show: what was measured, by which command, on which code."""
