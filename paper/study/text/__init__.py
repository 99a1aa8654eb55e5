"""Text of the study: tables, explanations of one item, and numbers of the manuscript."""
