"""Full-order runs, settling runs and replays of the reduced models."""
