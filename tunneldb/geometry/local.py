"""Tunnels in local coordinates."""

LOCAL = 0
"""SRID of a tunnel in local coordinates, metres without a place on Earth; PostGIS's number for no reference system."""

LOCAL_NAME = "local coordinates"
