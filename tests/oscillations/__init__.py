"""Mistakes in recorded data, as people made them: through every door, each with the line it gets.

``python -m tests.doors`` prints the table, and with ``--reports`` that of public reports.
"""
