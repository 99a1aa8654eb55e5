"""A measured record: file formats, columns, plausibility."""
