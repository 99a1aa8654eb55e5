"""Pages: results in, one self-contained HTML text out."""
