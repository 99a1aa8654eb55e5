"""What goes wrong in this room."""


class ApplyError(ValueError):
    """What was asked for cannot be done; the text is one line for the user."""
