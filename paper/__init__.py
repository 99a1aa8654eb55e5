"""The papers that are reproduced, one folder each, and the study that reproduces them."""
