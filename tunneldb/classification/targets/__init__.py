"""Target spheres in scans: where points are curved, candidates by votes, refinement, fit and check."""
