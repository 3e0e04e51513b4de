"""Members, faces and spots of simulated structures against their truth; see __main__.py."""
