"""What the study rests on: identified constants, toggled assumptions, error budget, floor, ensemble."""
