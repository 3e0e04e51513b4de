"""The desk in a browser on a survey of 25 km with 100,000 findings."""
