"""Change of the lining and of its leaks between two surveys."""
