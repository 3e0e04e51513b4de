"""Leaks that were found, against a truth: how many, how much of their area, how near to their edges."""
