"""The paper of 2006."""
