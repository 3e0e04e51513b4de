"""Laser scans on disk: reading, scanner positions, noise filter and thinning."""
