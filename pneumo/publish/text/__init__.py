"""Text: tables and numbers."""
