"""Any real scan: many small scans of the kinds people have, each run as its user would, and held against what is right."""
