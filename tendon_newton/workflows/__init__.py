"""What takes several packages: recording, deploying, climbing, comparing."""
