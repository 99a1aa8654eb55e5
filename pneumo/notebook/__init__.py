"""Fits and studies for notebooks and scripts: objects with text, tables, figures and checks."""
