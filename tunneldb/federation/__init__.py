"""A hub: one database whose views show the tunnels of several servers (postgres_fdw).

``load`` reads what the hub has, ``views`` computes the views over all servers, ``save`` writes them; ``servers``, ``check`` and
``hub`` are the steps of the command ``federate``.
"""

from tunneldb.federation.check import check_servers
from tunneldb.federation.load import Member, load_members
from tunneldb.federation.members import add_server, remove_server

__all__ = ["Member", "add_server", "check_servers", "load_members", "remove_server"]
