"""Deviation of the lining from its design profiles, overbreak and underbreak."""
