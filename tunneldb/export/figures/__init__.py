"""Figures: how far the axis lies from its design, how intensity depends on range and incidence."""
