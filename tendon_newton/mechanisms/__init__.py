"""Benches as USD assets, and the ``Mechanism`` that is read from one."""
