"""The paper of 2006: definition, tables, computations and proofs for its verdict."""
