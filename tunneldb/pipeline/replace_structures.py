"""Replace the members, faces and spots that were found in a survey."""

from __future__ import annotations

from typing import Any

import psycopg

from tunneldb.geometry.surface import Surface
from tunneldb.store.structures import SavedSpots, load_earlier_spots, save_structures
from tunneldb.store.survey import Survey
from tunneldb.structures.placement import place_structures
from tunneldb.structures.reconcile import reconcile_spots
from tunneldb.structures.results import Structures


def replace_structures(conn: psycopg.Connection[Any], survey: Survey, found: Structures, surface: Surface | None) -> SavedSpots:
    """Replace the members, faces and spots of a survey; a spot that is found again keeps its number and its review.

    Parameters
    ----------
    conn : Connection
        In a transaction.
    survey : Survey
    found : Structures
    surface : Surface or None
        Surface that gives chainages; None of a site, or before stage sections.
    """
    placed = place_structures(found, surface)
    own, others = load_earlier_spots(conn, survey)
    return save_structures(conn, survey, placed, reconcile_spots(found, own, others))
