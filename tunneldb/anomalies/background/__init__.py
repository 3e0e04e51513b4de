"""Level and standard deviation of the lining that is not dark, and how much darker than it each pixel is."""
