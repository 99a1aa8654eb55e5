"""Figures: dataset in, matplotlib figure out."""
