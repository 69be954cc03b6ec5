"""What the simulation must do, derived by hand or measured against a finer one."""
