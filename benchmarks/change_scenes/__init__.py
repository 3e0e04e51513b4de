"""Pairs of synthetic laser scans of one tunnel at two dates, with truth."""
