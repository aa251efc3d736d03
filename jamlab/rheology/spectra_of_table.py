"""Spectra of the packings in the table "spectra" of a campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from jamlab.errors import InputError, warn
from jamlab.rheology.complex_modulus import ComplexModulus
from jamlab.rheology.drag_law import DRAGS, DragLaw, make_law
from jamlab.statistics.rows_of_one_kind import (
    Select,
    check_packings_once,
    groups_of_numbers,
    rows_of_one_kind,
    stress_unit,
)

if TYPE_CHECKING:
    import pandas as pd

_CURVES, _LIMITS = ("omega", "storage", "loss", "error_bound"), ("g0", "eta0", "eta_inf")
_NEEDED = ("task", "model", "seed", "damping", "state", "target_pressure", *_CURVES, *_LIMITS, "converged")
_MEASURED = (
    *(name for name in _NEEDED if name not in ("model", "damping")),
    "seed",
    "pressure",
)  # may differ between packings that are averaged


class SpectraOfTable(NamedTuple):
    """Spectra of packings that differ in their pressure and random start alone."""

    by_pressure: dict[float, list[ComplexModulus]]  # target pressure, ascending -> packings, in the order of the table
    model: str
    damping: DragLaw
    units: str
    unit: str  # of stress


def spectra_of_table(source: Any, select: Select | None = None) -> SpectraOfTable:
    """Spectra by target pressure.

    Packings that did not converge are left out, with a warning that counts them.

    Args:
        source: campaign, or its table "spectra".
        select: column -> its value in the rows that are wanted.

    Raises:
        InputError: packings of several kinds, without a target pressure, or none that converged.
    """
    frame = rows_of_one_kind(source, "spectra", select, _MEASURED, _NEEDED)
    if frame["target_pressure"].isna().any():
        raise InputError(
            "the packings have no target pressure, so that no two have the same: use a sweep with pressures = [...]"
        )
    found: dict[float, list[ComplexModulus]] = {}
    missed: dict[float, int] = {}
    unit = stress_unit(frame)
    pressures = groups_of_numbers(frame["target_pressure"])
    for pressure, alike in frame.groupby(pressures, sort=True):
        check_packings_once(alike, f"target_pressure = {pressure:g}")
        own = found.setdefault(float(alike["target_pressure"].iloc[0]), [])
        for _, rows in alike.groupby(["task", "state"], sort=False):
            if rows["converged"].astype(bool).all():
                own.append(_spectrum(rows.sort_values("omega"), unit))
            else:
                missed[pressure] = missed.get(pressure, 0) + 1
    if missed:
        counts = ", ".join(f"{count} at {pressure:g}" for pressure, count in missed.items())
        total = sum(missed.values()) + sum(map(len, found.values()))
        told = f"left out of the mean: {sum(missed.values())} of {total} packings, which did not converge ({counts})"
        warn(f"{told}: most of these are unstable, and the mean is over a selection")
    if empty := [pressure for pressure, own in found.items() if not own]:
        raise InputError(f"no packing at target_pressure = {empty[0]:g} has a converged spectrum: leave it out")
    first = frame.iloc[0]
    units = frame["units"].iloc[0] if "units" in frame else frame.attrs.get("units", "")
    return SpectraOfTable(found, str(first["model"]), _law(first), units, unit)


def _law(row: Any) -> DragLaw:
    """The drag law of a row."""
    name = str(row["damping"])
    declared = DRAGS.get(name).parameters()
    values = {each: row[column] for each in declared for column in (each, f"{name}_{each}") if column in row}
    return make_law(name, {each: value for each, value in values.items() if value == value})  # nan: of other laws


def _spectrum(rows: pd.DataFrame, unit: str) -> ComplexModulus:
    """The spectrum of one packing from its rows, one for each frequency."""
    curves: dict[str, Any] = {name: rows[name].to_numpy(np.float64) for name in _CURVES}
    if not np.all(np.diff(curves["omega"]) > 0):
        raise InputError(
            f"task {rows['task'].iloc[0]}, state {rows['state'].iloc[0]}: the table holds a frequency twice: "
            "leave out rows that are repeated"
        )
    g0, eta0, eta_inf = (float(rows[name].iloc[0]) for name in _LIMITS)
    storage, loss, error_bound = (curves[name] for name in _CURVES[1:])
    return ComplexModulus(curves["omega"], storage, loss, g0, eta0, eta_inf, "campaign", error_bound, unit=unit)
