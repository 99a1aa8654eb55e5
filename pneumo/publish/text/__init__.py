"""Text: tables, explanations of one item, and the manuscript."""
