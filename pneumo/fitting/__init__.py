"""Models fitted to a measured record: estimates, intervals, warnings."""
