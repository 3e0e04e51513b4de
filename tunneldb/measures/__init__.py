"""Measures of a lining, made on demand: each folder computes, saves and reads one of them."""
