"""Computation of evenness; arrays only."""
