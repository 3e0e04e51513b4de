"""Rays from the scanner: what they meet in the tunnel, and what is measured there."""
