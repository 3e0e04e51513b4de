"""Figures: deviation of the axis from its design, dependence of intensity on range and incidence."""
