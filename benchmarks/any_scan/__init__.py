"""Any real scan: many small scans of the kinds people have, each run as its user would and judged against what is right for it."""
