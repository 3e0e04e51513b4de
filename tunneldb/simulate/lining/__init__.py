"""What the lining and the floor of a synthetic tunnel are like: rings, relief, reflectance, marks, leaks, ballast."""
