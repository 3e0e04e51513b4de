"""Eighth round: eight tunnels of eight kinds, from Alpine railways to a utility tunnel."""

from benchmarks.blind.round_08 import (
    china_metro,
    highway_tiles,
    karst_stone,
    mountain_road,
    shinkansen,
    shotcrete_dry,
    station_cladding,
    utility,
)

SCENES = (
    china_metro.SCENE,
    shinkansen.SCENE,
    utility.SCENE,
    highway_tiles.SCENE,
    mountain_road.SCENE,
    karst_stone.SCENE,
    station_cladding.SCENE,
    shotcrete_dry.SCENE,
)
