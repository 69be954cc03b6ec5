"""Jobs in turn, in processes and on a cluster."""
