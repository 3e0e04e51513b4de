"""Rings of the lining: shape, joints and steps; and rings of surveyed points."""
