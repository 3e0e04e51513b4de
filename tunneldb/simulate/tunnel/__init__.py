"""Shape of a synthetic tunnel: its centre line, its cross-section, and the section swept along the line."""
