"""Structures of faces and members, and spots that differ from their own surface (after Ono et al.).

Knows arrays only: no database and no file.
"""
