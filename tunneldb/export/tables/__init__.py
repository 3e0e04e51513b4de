"""Leaks and target spheres as tables and reports."""
