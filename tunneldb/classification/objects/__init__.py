"""Points that are neither ground nor lining: clusters, their classes and the cells they fill."""
