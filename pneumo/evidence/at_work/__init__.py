"""Models used in observers and position controllers."""
