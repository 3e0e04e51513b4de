"""Computation of clearance; arrays only."""
