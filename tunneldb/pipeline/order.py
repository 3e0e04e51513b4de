"""The stages of a kilometre by name, for those who show them: apart from what they do, which takes long to import."""

STAGES = ("load", "axis", "segments", "sections", "ground", "detect")
"""Stages of a kilometre, in their order."""
