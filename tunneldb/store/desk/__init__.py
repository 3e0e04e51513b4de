"""Queries of the desk in a browser: they use ``tunnel_api`` alone, with the rights of the person signed in."""
