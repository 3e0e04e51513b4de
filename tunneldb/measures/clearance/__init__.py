"""Clearance of an outline about a track or lane."""
