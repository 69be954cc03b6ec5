"""Put what the search found to the test: which causes are named, and the account of each."""
