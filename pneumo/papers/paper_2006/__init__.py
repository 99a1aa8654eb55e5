"""The paper of 2006: what its claims are compared with."""
