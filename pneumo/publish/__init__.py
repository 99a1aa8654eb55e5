"""Showing: results become pictures and pages, and nothing is computed here."""
