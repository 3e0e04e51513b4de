"""Evenness of the lining beneath a virtual straightedge."""
