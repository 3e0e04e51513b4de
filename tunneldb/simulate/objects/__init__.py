"""Objects of a synthetic tunnel: fixtures on the lining, recesses in it, hanging and standing objects."""
