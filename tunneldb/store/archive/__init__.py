"""A survey's rows out of the database and into another: which tables they are in, and what in them refers to what."""
