"""Confidence intervals, and the best n."""
