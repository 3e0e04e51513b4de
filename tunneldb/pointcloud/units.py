"""Units of the coordinates of scan files: metres, or as given by the user."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tunneldb.errors import InputError
from tunneldb.geometry.crs import StatedUnit, describe_heights, height_unit, plan_unit
from tunneldb.geometry.units import Units, unit_name, unit_option
from tunneldb.pointcloud.points import ScanHeader


@dataclass(frozen=True)
class GivenUnits:
    """Units that the user gave for the coordinates of files, by their names in options.

    Attributes
    ----------
    plan, height : str or None
        Unit of x and y, and of z, a key of `tunneldb.geometry.units.METRES`; None if not given.
    """

    plan: str | None = None
    height: str | None = None


NOT_GIVEN = GivenUnits()


def in_units(header: ScanHeader, given: GivenUnits) -> ScanHeader:
    """Return a header whose coordinates are converted from the given units.

    If only that of x and y is given, z has the one that the file states for heights, else the same.
    """
    if given == NOT_GIVEN:
        return header
    plan = given.plan or "m"
    known = given.height or (_stated_height(header, plan) if given.plan else None)
    units = Units(plan, known or "m")
    scales = units.scales / header.units.scales
    return replace(
        header,
        low=header.low * scales,
        high=header.high * scales,
        units=units,
        unit_given=given.plan is not None,
        height_unit_given=known is not None,
    )


def _stated_height(header: ScanHeader, plan: str) -> str | None:
    """Return the unit of z by the file, that of the plan if it states none; None if it contradicts itself or the plan."""
    stated = height_unit(header.crs, header.stated.heights)
    if header.stated.height_fault or (plan == "m" and stated is not None and stated.metres != 1.0):
        return None
    return plan if stated is None else _option(stated)


def require_metres(header: ScanHeader) -> None:
    """Refuse a file whose coordinates are not in metres, or may not be, unless the user gave their units.

    Raises
    ------
    InputError
        With both values, and the options to type.
    """
    faults = unit_faults(header)
    if faults:
        raise InputError(f"{header.path}: {'; '.join(faults)}")


def unit_faults(header: ScanHeader) -> list[str]:
    """Return why the coordinates of a file are not in metres, or may not be, each with both values and the option to type."""
    return [fault for fault in (_plan_fault(header), _height_fault(header)) if fault]


def suggested_options(header: ScanHeader) -> str:
    """Return the options that convert a file with `unit_faults`, UNIT where it is contradictory; empty if none does."""
    options = []
    stated = plan_unit(header.crs) if header.crs else None
    if _plan_fault(header):
        options.append(("--unit", "UNIT" if header.stated.unit_fault else stated and _option(stated)))
    if _height_fault(header):
        up = height_unit(header.crs, header.stated.heights)
        options.append(("--height-unit", "UNIT" if header.stated.height_fault else up and _option(up)))
    return "" if any(name is None for _, name in options) else "".join(f" {option} {name}" for option, name in options)


def conversion_note(header: ScanHeader) -> str | None:
    """Return a note on the conversion of coordinates to metres as given by the user; None if there is none."""
    parts = []
    if header.unit_given:
        stated = plan_unit(header.crs) if header.crs else None
        parts.append(_conversion("x and y", header.units.plan, stated, header.stated.unit_fault))
    if header.height_unit_given:
        stated = height_unit(header.crs, header.stated.heights)
        parts.append(_conversion("z", header.units.height, stated, header.stated.height_fault))
    return "; ".join(filter(None, parts)) or None


def _conversion(what: str, unit: str, stated: StatedUnit | None, fault: str) -> str:
    said = fault or (f"the file states {stated.name}" if stated is not None and _option(stated) != unit else "")
    if unit == "m" and not said:
        return ""
    done = "taken as metres" if unit == "m" else f"converted from {unit_name(unit)} to metres"
    return f"{what} {done}, as given" + (f" ({said})" if said else "")


def _plan_fault(header: ScanHeader) -> str:
    if header.unit_given or header.crs is None:
        return ""
    unit = plan_unit(header.crs)
    if header.stated.unit_fault:
        return f"{header.stated.unit_fault}; give the unit of x and y: {_either('--unit', unit)}"
    if unit is None or unit.metres in (None, 1.0):
        return ""
    return f"its x and y are in {unit.name} by its coordinate system ({header.crs.name}), not metres; {_mend('--unit', unit)}"


def _height_fault(header: ScanHeader) -> str:
    if header.height_unit_given:
        return ""
    unit = height_unit(header.crs, header.stated.heights)
    if header.stated.height_fault:
        return f"{header.stated.height_fault}; give the unit of z: {_either('--height-unit', unit)}"
    if unit is None or unit.metres in (None, 1.0):
        return ""
    plan = plan_unit(header.crs) if header.crs else None
    beside = f", its x and y in {plan.name}" if plan else ""
    system = describe_heights(header.crs, header.stated.heights)
    return f"its heights are in {unit.name} ({system}){beside}; {_mend('--height-unit', unit)}"


def _option(unit: StatedUnit) -> str | None:
    return None if unit.metres is None else unit_option(unit.metres)


def _either(option: str, unit: StatedUnit | None) -> str:
    other = _option(unit) if unit is not None else None
    return f"{option} m or {option} {other if other not in (None, 'm') else 'us-ft'}"


def _mend(option: str, unit: StatedUnit) -> str:
    name = _option(unit)
    return "transform the file to metres" if name is None else f"convert them by {option} {name}"
