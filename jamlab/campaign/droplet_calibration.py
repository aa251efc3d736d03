"""Calibration of the droplets' force law, which Boromand et al. do not print, against their tables 1 and 2.

Each of gamma, ka, delta and the number of vertices is halved and doubled in turn, the same seeds compressed from onset
to rho = 0.99, and every observable read off at fixed distances from onset. The table of changes is the sensitivity of
the model; a parabola in log2 of each parameter, through its three points, is the surface on which the fit looks for
the values that come nearest to the paper.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from jamlab.checks import check_bidisperse
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.packing.atomic_file import atomic_file, make_folder
from jamlab.statistics.published_numbers import SHAPE_AT_CONFLUENCE, table_contacts, table_modulus

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

FITTED = ("gamma", "ka", "delta")
CONFLUENCE = 0.99  # last true packing fraction of the sweeps
DISTANCES = {"z": (0.05, 0.1), "G": (0.05, 0.1, 0.15)}  # rho - rho_J; further up z is bound by 6, table 1 is not
_LEAST_POINTS = 3


@dataclass(frozen=True)
class Target:
    """What the paper says of one observable.

    Attributes:
        value: from a fit or a figure of Boromand et al.
        tolerance: how far off counts as one unit of misfit.
        source: where it is printed.
    """

    value: float
    tolerance: float
    source: str


def _at_distance(name: str, distance: float) -> Target:
    if name == "z":
        return Target(table_contacts("DP(ρ)", distance), 0.1, "table 1")
    value = table_modulus("DP(ρ)", distance)
    return Target(value, 0.1 * value, "table 2")


TARGETS: Mapping[str, Target] = {
    **{f"{name}({d:g})": _at_distance(name, d) for name, distances in DISTANCES.items() for d in distances},
    "A": Target(SHAPE_AT_CONFLUENCE.value, 0.01, "fig 4c, at confluence"),
    "area deficit": Target(0.0, 0.01, "fig 11c: constant"),
}


def campaign_text(n: int, seeds: int, law: Mapping[str, float] | None = None) -> str:
    """Campaign file of the scan: the default law, and each parameter halved and doubled.

    Args:
        n: droplets in each packing, even.
        seeds: packings for each set of parameters.
        law: values that replace the defaults as the centre of the scan.

    Raises:
        InputError: a parameter that cannot be varied.
    """
    centre = {name: float(defaults("dp")[name]) for name in FITTED}
    unknown = set(law or {}) - set(centre)
    if unknown:
        raise InputError(f"parameter {sorted(unknown)[0]!r} is not calibrated: use {', '.join(FITTED)}")
    centre |= law or {}
    laws = {"centre": dict(centre)}
    for name in FITTED:
        laws |= {
            f"{name}-halved": centre | {name: 0.5 * centre[name]},
            f"{name}-doubled": centre | {name: 2 * centre[name]},
        }
    vertices = {name: int(defaults("dp")[name]) for name in ("nv_small", "nv_large")}
    laws["vertices-doubled"] = {**centre, **{name: 2 * count for name, count in vertices.items()}}
    text = ['name = "calibration"\n']
    for sweep, values in laws.items():
        force_law = ", ".join(f"{name} = {value!r}" for name, value in values.items())
        text.append(
            f'[[sweep]]\nname = "{sweep}"\nmodel = "dp"\nn = {n}\nseeds = {seeds}\n'
            f'compress = {{ by = "rho", to = {CONFLUENCE}, step = 0.01, nearest = 1e-3 }}\n'
            f"force_law = {{ {force_law} }}\n"
        )
    return "\n".join(text)


def observables(states: "pd.DataFrame") -> "pd.DataFrame":
    """What is compared, one row per packing.

    Args:
        states: table "states" of one sweep of `campaign_text`.

    Returns:
        Columns rho_J, z(d) and G(d) at the `DISTANCES`, A (bare outline) and A with rim, and area deficit
        1 - a/a_J, the last three at the last state. Values between two states are interpolated; G of states that are
        not stable is left out.
    """
    import pandas as pd

    rows = []
    for (_, seed), sweep in states.groupby(["n", "seed"]):
        good = sweep[sweep["converged"].astype(bool)].sort_values("rho")
        start = sweep[sweep["state"] == 0].iloc[0]
        distance = (good["rho"] - start["onset"]).to_numpy()
        row: dict[str, Any] = {"seed": seed, "rho_J": start["onset"]}
        for column, name in (("z", "z"), ("g", "G")):
            row |= {f"{name}({d:g})": _at(d, distance, good[column].to_numpy()) for d in DISTANCES[name]}
        last = good.iloc[-1]
        near = last["rho"] > CONFLUENCE - 0.002
        row["A"] = last["shape"] if near else np.nan
        row["A with rim"] = last["shape_rim"] if near else np.nan
        row["area deficit"] = 1 - last["area"] / start["area"] if near else np.nan
        rows.append(row)
    return pd.DataFrame(rows)


def _at(d: float, distance: Array, values: Array) -> float:
    known = np.isfinite(values)
    if known.sum() < _LEAST_POINTS:
        return float("nan")
    return float(np.interp(d, distance[known], values[known], left=np.nan, right=np.nan))


def sensitivity(tables: Mapping[str, "pd.DataFrame"]) -> "pd.DataFrame":
    """Mean of every observable for each set of parameters, and the change against the centre on the same seeds.

    Args:
        tables: name of the sweep -> `observables` of it; "centre" must be there.

    Returns:
        One row per set and observable: mean, its standard error, change, and the standard error of the change (both
        from packings of equal seed, so that the scatter of the seeds drops out), and the number of packings.
    """
    import pandas as pd

    if "centre" not in tables:
        raise InputError("no sweep 'centre' to compare with: run the whole scan")
    centre = tables["centre"].set_index("seed")
    rows = []
    for name, table in tables.items():
        here = table.set_index("seed")
        for column in here.columns:
            values = here[column].dropna()
            change = (here[column] - centre[column]).dropna()
            rows.append(
                {
                    "set": name,
                    "observable": column,
                    "mean": values.mean(),
                    "error": values.std(ddof=1) / np.sqrt(len(values)),
                    "change": change.mean(),
                    "change_error": change.std(ddof=1) / np.sqrt(len(change)),
                    "packings": len(values),
                }
            )
    return pd.DataFrame(rows)


@dataclass(frozen=True)
class Calibration:
    """Result of the fit.

    Attributes:
        law: gamma (eps/l), ka (eps/l^4), delta (l) that come nearest to the paper.
        predicted: every target observable there, on the fitted surface.
        misfit: root of the mean squared misfit, in units of the tolerances; `misfit_at_centre` the same for the centre.
        at_edge: parameters that ended at the edge of the scan, a factor of 2 off the centre: scan again from there.
    """

    law: dict[str, float]
    predicted: dict[str, float]
    misfit: float
    misfit_at_centre: float
    at_edge: tuple[str, ...]


def fit(changes: "pd.DataFrame", centre: Mapping[str, float]) -> Calibration:
    """Values of gamma, ka and delta within a factor of 2 of the centre that come nearest to `TARGETS`.

    Args:
        changes: from `sensitivity`.
        centre: parameters of the sweep "centre".

    Raises:
        InputError: a set of parameters is missing, or an observable could not be measured.
    """
    table = changes.pivot(index="set", columns="observable", values="mean")
    needed = ["centre", *(f"{name}-{side}" for name in FITTED for side in ("halved", "doubled"))]
    missing = [name for name in needed if name not in table.index]
    if missing:
        raise InputError(f"sweep {missing[0]!r} is not there: run the whole scan")
    names = list(TARGETS)
    values = table.loc[needed, names].to_numpy(dtype=np.float64)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise InputError(f"{names[column]} of sweep {needed[row]!r} was not measured: add seeds")
    at_centre, halved, doubled = values[0], values[1::2], values[2::2]
    slope, bend = 0.5 * (doubled - halved), 0.5 * (doubled + halved) - at_centre
    target = np.array([TARGETS[name].value for name in names])
    tolerance = np.array([TARGETS[name].tolerance for name in names])

    def surface(x: Array) -> Array:
        return np.asarray(at_centre + x @ slope + x**2 @ bend)

    def misfit(x: Array) -> float:
        return float(np.mean(((surface(x) - target) / tolerance) ** 2))

    starts = [np.zeros(len(FITTED)), *(0.5 * np.array([a, b, c]) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1))]
    found = min((minimize(misfit, x, bounds=[(-1, 1)] * len(FITTED)) for x in starts), key=lambda result: result.fun)
    law = {name: float(centre[name] * 2**x) for name, x in zip(FITTED, found.x, strict=True)}
    edge = tuple(name for name, x in zip(FITTED, found.x, strict=True) if abs(x) > 1 - 1e-6)
    predicted = dict(zip(names, surface(found.x).tolist(), strict=True))
    return Calibration(law, predicted, found.fun**0.5, misfit(np.zeros(len(FITTED))) ** 0.5, edge)


def calibrate(
    folder: Path, n: int = 32, seeds: int = 8, law: Mapping[str, float] | None = None, **how: Any
) -> tuple["pd.DataFrame", Calibration]:
    """Run the scan and fit; may be stopped and called again.

    Args:
        folder: of the scan; tasks that are there already are not done again.
        n: droplets in each packing.
        seeds: packings for each set of parameters.
        law: centre of the scan, by default the defaults.
        how: passed on to `Campaign.run`: `workers`, `tell`.

    Returns:
        The sensitivity table and the fit.

    Raises:
        InputError: values that no scan can start from, or an observable that too few packings reached.
        StorageError: the folder cannot be written.
    """
    from jamlab.campaign.campaign import open_campaign

    check_bidisperse(n, 0, 1.0)
    if seeds < 2:
        raise InputError(f"seeds = {seeds}: standard errors need 2 or more")
    text = campaign_text(n, seeds, law)
    make_folder(folder)
    file = folder / "calibration.toml"
    with atomic_file(file) as temporary:
        temporary.write_text(text, encoding="utf-8")
    campaign = open_campaign(file)
    campaign.run(**how)
    tables = {sweep.name: observables(campaign.table("states", sweep.name)) for sweep in campaign.content.sweep}
    changes = sensitivity(tables)
    centre = {name: float(defaults("dp")[name]) for name in FITTED} | dict(law or {})
    return changes, fit(changes, centre)
