"""Structures by authors who have not read the program, and what detection makes of them."""
