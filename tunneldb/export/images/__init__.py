"""Images of the unrolled lining as files: Cloud Optimized GeoTIFFs and previews."""
