"""Figures, pages and text made from results; nothing is computed here."""
