"""Ground of a tunnel: its heights row by row, and the feet of the walls (Li et al. 2023, section 2.1)."""
