"""Text of the study: tables, explanations of one cell, and numbers of the manuscript."""
