"""The report of a diagnosis: words, tables and figures on one page."""
