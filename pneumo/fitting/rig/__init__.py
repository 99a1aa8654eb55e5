"""Fits to one volume of gas on a rig: a chamber behind a valve and perhaps a hose, or a vessel."""
