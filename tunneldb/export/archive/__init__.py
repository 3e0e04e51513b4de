"""A whole survey as one file, and back."""
