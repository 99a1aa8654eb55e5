"""What the study rests on: identified constants, other assumptions, error budget, floor, ensemble, cylinders."""
