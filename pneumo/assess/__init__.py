"""Comparing: statistics, the published tables, the verdict."""
