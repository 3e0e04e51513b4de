"""Thickness and volume between the linings of two surveys."""
