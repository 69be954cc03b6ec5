"""Recordings, datasets, model files and cards: all that a computer without a simulator loads."""
