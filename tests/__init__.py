"""The tests of tendon_newton."""
