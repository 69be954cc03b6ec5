"""Diagnoses of datasets with known causes, and how often they are right."""
