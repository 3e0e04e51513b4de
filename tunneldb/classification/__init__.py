"""Ground, lining, what stands between them, and target spheres (Li et al., 2023)."""
