"""Constants that the paper does not print, identified from its tables."""
