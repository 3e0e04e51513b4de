"""Canals by authors who have not read the program, and what registration makes of them."""
