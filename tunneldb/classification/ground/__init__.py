"""The ground of a tunnel: its heights row by row and where the walls meet it (Li et al. 2023, section 2.1)."""
