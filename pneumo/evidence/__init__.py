"""What the study rests on: identification, toggled assumptions, error budget, floor, ensemble, random cylinders."""
