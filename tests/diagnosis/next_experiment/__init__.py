"""Tests of the run that is proposed, planned or designed next."""
