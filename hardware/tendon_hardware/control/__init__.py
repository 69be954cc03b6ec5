"""Sources of goals and commands: policies, keyboards and the network."""
