"""From YAML and CSV to a validated study in SI units."""
