"""Structures of faces and members, and what on them differs from their own surface (after Ono et al.).

Knows arrays only: no database and no file.
"""
