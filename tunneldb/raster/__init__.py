"""The unrolled image: points projected, gathered by pixel, and what each pixel shows."""
