"""Tests of deploying a policy."""
