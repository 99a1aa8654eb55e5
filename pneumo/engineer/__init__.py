"""For engineers: own cylinders, measurements, linear models, source code."""
