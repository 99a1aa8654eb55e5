"""Running it: integrator, excitation, full-order runs, settling runs and replays."""
