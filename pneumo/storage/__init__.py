"""Results on disk: NetCDF and JSON files, their layout and their SHA-256."""
