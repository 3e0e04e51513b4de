"""Computation of change; arrays only."""
