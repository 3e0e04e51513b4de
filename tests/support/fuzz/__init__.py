"""Malformed files and hostile words for every command: what may come of them is a right result, or exit code 2 and one line."""
