"""The paper's results, each beside the paper's number, from recordings to tables."""
