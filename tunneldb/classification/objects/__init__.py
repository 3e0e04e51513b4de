"""What is neither ground nor lining: clusters of points, their classes and the cells they fill."""
