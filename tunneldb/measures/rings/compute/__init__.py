"""Computation of rings; arrays only."""
