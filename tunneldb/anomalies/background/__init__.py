"""Level and standard deviation of the dry lining (background), and the darkening of each pixel relative to it."""
