"""Random cylinders of catalogue sizes: runs, regimes, the direct rule."""
