"""Queries of the desk in a browser, by the views and functions of ``tunnel_api`` and with the rights of the person signed in."""
