"""What is dark on the lining: background, threshold, regions, leaks among them and their geometries (Xu et al., 2018)."""
