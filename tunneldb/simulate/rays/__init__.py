"""Rays of the scanner: their hits in the tunnel, and the measured values."""
