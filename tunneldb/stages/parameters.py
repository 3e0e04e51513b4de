"""Parameters of the stages: names, defaults, bounds and descriptions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from tunneldb.errors import InputError, did_you_mean
from tunneldb.numerals import parse_number


@dataclass(frozen=True)
class Parameter:
    """Numeric parameter of a stage.

    Attributes
    ----------
    default, low, high : float
        Default value and the bounds of what is allowed.
    unit, text : str
        Its unit ("" for a pure number) and what it means.
    whole : bool
        Whether it must be a whole number.
    """

    default: float
    low: float
    high: float
    unit: str
    text: str
    whole: bool = False


PARAMETERS: dict[str, Parameter] = {
    "axis.half_width": Parameter(1.0, 0.05, 3.0, "m", "half the thickness of the slab of points for a vertex"),
    "axis.angle_step": Parameter(5.0, 1.0, 20.0, "°", "width of the angular classes for a vertex"),
    "axis.tolerance": Parameter(0.002, 1e-5, 1.0, "m", "maximum movement of vertices in the last pass"),
    "axis.max_iterations": Parameter(20, 1, 100, "", "maximum number of passes", whole=True),
    "axis.max_deviation": Parameter(0.5, 0.05, 10.0, "m", "deviation from its neighbours above which a vertex is interpolated"),
    "axis.max_rejected": Parameter(0.3, 0.0, 1.0, "", "maximum share of interpolated vertices; one is always allowed"),
    "section.angle_step": Parameter(5.0, 1.0, 20.0, "°", "width of an angular class; must divide 180"),
    "section.half_width": Parameter(0.15, 0.01, 2.5, "m", "initial half thickness of a section's slab"),
    "section.max_half_width": Parameter(2.5, 0.01, 2.5, "m", "maximum half thickness of a slab if classes have too few points"),
    "section.min_points": Parameter(5, 2, 1000, "", "minimum number of points of a class", whole=True),
    "section.protrusion": Parameter(0.03, 0.001, 1.0, "m", "protrusion from which a class is a fixture and not the wall"),
    "ground.voxel": Parameter(0.1, 0.02, 0.5, "m", "edge of the voxels for thinning points before the ground search"),
    "ground.distance": Parameter(0.05, 0.005, 0.5, "m", "maximum distance of a point on a plane"),
    "ground.angle": Parameter(15.0, 1.0, 60.0, "°", "maximum deviation of the ground's normals from the vertical"),
    "ground.gamma": Parameter(0.1, 0.01, 0.5, "m", "maximum thickness of ground above its height; each metre has its own"),
    "ground.radius": Parameter(0.3, 0.05, 2.0, "m", "radius of the neighbourhood of a normal"),
    "cluster.radius": Parameter(3.0, 1.0, 20.0, "", "radius of the neighbourhood in a cluster, in point spacings"),
    "cluster.min_points": Parameter(4, 1, 1000, "", "minimum points near a core point, itself included", whole=True),
    "cluster.region": Parameter(0.4, 0.05, 1.0, "", "part of the tunnel's height, from the ground, with objects"),
    "lining.tolerance": Parameter(0.5, 0.01, 5.0, "m", "maximum distance of lining inside the surface"),
    "lining.recess": Parameter(1.2, 0.01, 3.0, "m", "maximum distance of lining behind the surface, niches included"),
    "image.pixel": Parameter(
        0.0, 0.0, 0.5, "m", "edge of a pixel of the unrolled images; 0: 0.02, 0.04, 0.08 or 0.2, by the density of points"
    ),
    "image.spacing": Parameter(
        0.0,
        0.0,
        1.25,
        "m",
        "distance of profiles along the tunnel, with the nearest shown between them; 0: from the points",
    ),
    "image.min_density": Parameter(
        12.0,
        0.0,
        1e6,
        "/m²",
        "lining with fewer points around it is not inspected: at 12 the noise filter's widest circle still holds a wall's "
        "points (it classifies 2 % of them as noise, at 5 45 %), and the widest median filter 12 pixels with points",
    ),
    "intensity.max_incidence": Parameter(75.0, 30.0, 89.0, "°", "maximum incidence of points in the images"),
    "intensity.max_range": Parameter(40.0, 2.0, 1000.0, "m", "maximum range of points in the images"),
    "intensity.max_outside": Parameter(
        0.05, 0.0, 1.0, "", "maximum share of the lining's points outside the reference curve, which are left out"
    ),
    "appendage.distance": Parameter(0.03, 0.005, 0.5, "m", "distance from the local plane from which a pixel is a fixture"),
    "detect.model": Parameter(
        1,
        0,
        2**31 - 1,
        "",
        "segmentation network; 1: that of tunneldb, FILE.onnx or the number of one that was used before: your own, 0: none",
        whole=True,
    ),
    "leak.min_area": Parameter(0.05, 0.0, 100.0, "m²", "minimum area of a leak"),
    "leak.demand_area": Parameter(
        0.3, 0.05, 3.0, "m²", "area of the leaks that the survey must show; where it may miss them is stated (detectability)"
    ),
    "leak.demand_drop": Parameter(3.0, 0.7, 9.0, "dB", "darkening of these leaks relative to dry lining"),
}


def settings(assignments: Iterable[str] = ()) -> dict[str, float]:
    """Return the values of all parameters, some of them set as ``name=value``.

    Raises
    ------
    InputError
        For an unknown name, a value that is no number, one out of bounds, or two that do not go together.
    """
    values = {name: parameter.default for name, parameter in PARAMETERS.items()}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if name not in PARAMETERS:
            raise InputError(f"unknown parameter {name!r}; known are {', '.join(PARAMETERS)}.{did_you_mean(name, PARAMETERS)}")
        values[name] = _value(name, text if equals else "")
    check_together(values)
    return values


def check_together(values: Mapping[str, float]) -> None:
    """Check the values of all parameters together, beyond their bounds.

    Raises
    ------
    InputError
        If they do not.
    """
    if 180.0 / values["section.angle_step"] % 1 > 1e-9:
        raise InputError(f"section.angle_step must divide 180 degrees: {values['section.angle_step']:g} does not")
    if values["section.half_width"] > values["section.max_half_width"]:
        raise InputError("section.half_width must not exceed section.max_half_width")


def of_stage(values: Mapping[str, float], prefixes: Iterable[str]) -> dict[str, float]:
    """Return the values whose names begin with one of the prefixes: those that a stage depends on."""
    chosen = tuple(f"{prefix}." for prefix in prefixes)
    return {name: value for name, value in values.items() if name.startswith(chosen)}


def _value(name: str, text: str) -> float:
    parameter = PARAMETERS[name]
    try:
        value = parse_number(text)
    except ValueError:
        raise InputError(f"{name} needs a number, not {text!r}: --set {name}={parameter.default:g}") from None
    if not parameter.low <= value <= parameter.high:
        raise InputError(f"{name}={value:g} is out of bounds {parameter.low:g} to {parameter.high:g} {parameter.unit}".rstrip())
    if parameter.whole and value != int(value):
        raise InputError(f"{name}={value:g} must be a whole number")
    return value
