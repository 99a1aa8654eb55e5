"""Judging a paper: claims, published tables, errata, assumptions, comparison with what was reproduced."""
