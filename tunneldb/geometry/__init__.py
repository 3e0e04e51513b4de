"""Axis, segment, section and unrolling: the mathematics of ``sql/``, vectorised for full density."""
