"""For the engineer with a cylinder: simulate, replay, linearise and export, all on the functions of physics."""
