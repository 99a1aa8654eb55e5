"""Evidence beside the study: identified constants, toggled assumptions, error budget, floor, ensemble."""
