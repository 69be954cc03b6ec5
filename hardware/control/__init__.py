"""Where goals come from: policies, keyboards and the network."""
