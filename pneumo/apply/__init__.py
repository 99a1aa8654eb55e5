"""For the engineer with a cylinder: simulate, replay, linearise, export, on the functions of physics."""
