"""What users call: rollouts, the control loop and the Newton solver."""
