"""What takes several packages: recording, deploying, climbing, refreshing, reproducing."""
