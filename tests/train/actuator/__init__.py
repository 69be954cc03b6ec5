"""Force networks: data, networks, training, files, evaluation."""
