"""Scan files written again with classes: those of a survey, or one by itself."""
