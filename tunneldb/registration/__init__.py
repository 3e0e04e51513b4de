"""How coordinates of scans lie to those of others: control points and rigid motions."""
