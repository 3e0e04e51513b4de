"""Scenes that detection has never seen, written by others; see README.md."""
