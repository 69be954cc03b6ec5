"""Jobs in turn and in processes."""
