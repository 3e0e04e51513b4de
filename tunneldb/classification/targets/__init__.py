"""Target spheres in scans: curved cells, candidates by votes, refinement, fit and check."""
