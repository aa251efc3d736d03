"""Calibrate the droplets' force law, which Boromand et al. do not print, against their tables 1 and 2.

`python -m studies.droplet_calibration FOLDER`: a campaign scans the parameters. Each of gamma, ka and delta is halved
and doubled in turn, and the number of vertices is doubled;
each time the same seeds are compressed from onset to rho = 0.99. Every observable is read off at fixed
distances from onset. Its changes between sweeps are the sensitivity of the model. For the fit, every observable is
modelled as a sum of parabolas, one in log2 of each parameter through its three points, and the parameters are chosen
that bring all of them closest to the paper.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from jamlab.arrays import Array
from jamlab.campaign.campaign import Campaign, open_campaign
from jamlab.checks import check_bidisperse
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.storage.atomic_file import atomic_file, make_folder
from studies.published_numbers import SHAPE_AT_CONFLUENCE, table_contacts, table_modulus

FITTED = ("gamma", "ka", "delta")
_NUMBERS = ["mean", "error", "change", "change_error"]
_SIDES = {"halved": 0.5, "doubled": 2}
CONFLUENCE = 0.99  # true packing fraction at which sweeps end and droplets count as confluent
DISTANCES = {"z": (0.05, 0.1), "G": (0.05, 0.1, 0.15)}  # rho - rho_J; further up z is limited to 6, table 1 is not
_NEAR_CONFLUENCE = 0.002  # in rho, a fifth of a step; a sweep that ends earlier is not confluent
_LEAST_POINTS = 3  # states of a sweep below which interpolation between them is not trusted


class Target(NamedTuple):
    """Value of one observable in Boromand et al., the deviation that counts as one unit of misfit, and its source."""

    value: float
    tolerance: float
    source: str


TARGETS: Mapping[str, Target] = {
    **{f"z({d:g})": Target(table_contacts("DP(ρ)", d), 0.1, "table 1") for d in DISTANCES["z"]},
    **{f"G({d:g})": Target(g := table_modulus("DP(ρ)", d), 0.1 * g, "table 2") for d in DISTANCES["G"]},
    "A": Target(SHAPE_AT_CONFLUENCE.value, 0.01, "fig 4c, at confluence"),
    "area deficit": Target(0.0, 0.01, "fig 11c: constant"),
}


def _centre(law: Mapping[str, float]) -> dict[str, float]:
    return {name: float(defaults("dp")[name]) for name in FITTED} | dict(law)


def campaign_text(n: int, seeds: int, law: Mapping[str, float]) -> str:
    """Write the campaign file of the scan: a law at its centre, and each parameter halved and doubled."""
    if unknown := sorted(set(law) - set(FITTED)):
        raise InputError(f"parameter {unknown[0]!r} is not calibrated: use {', '.join(FITTED)}")
    centre = _centre(law)
    laws = {"centre": centre}
    for name in FITTED:
        laws |= {f"{name}-{side}": centre | {name: f * centre[name]} for side, f in _SIDES.items()}
    laws["vertices-doubled"] = centre | {name: 2 * int(defaults("dp")[name]) for name in ("nv_small", "nv_large")}
    text = ['name = "calibration"\n']
    for sweep, values in laws.items():
        force_law = ", ".join(f"{name} = {value!r}" for name, value in values.items())
        text.append(
            f'[[sweep]]\nname = "{sweep}"\nmodel = "dp"\nn = {n}\nseeds = {seeds}\n'
            f'compress = {{ by = "rho", to = {CONFLUENCE}, step = 0.01, nearest = 1e-3 }}\n'
            f"force_law = {{ {force_law} }}\n"
        )
    return "\n".join(text)


def observables(states: pd.DataFrame) -> pd.DataFrame:
    """Read off the observables to compare from the states of one sweep, one row per packing. Columns: seed, rho_J, z(d)
    and G(d) at the `DISTANCES`, interpolated between states of which the unstable have no G; A of the bare outline, A
    with rim, and area deficit 1 - a/a_J at the last state, where it is confluent."""
    rows = []
    for (_, seed), sweep in states.groupby(["n", "seed"]):
        good = sweep[sweep["converged"].astype(bool)].sort_values("rho")
        start, last = sweep[sweep["state"] == 0].iloc[0], good.iloc[-1]
        row: dict[str, Any] = {"seed": seed, "rho_J": start["onset"]}
        for column, name in (("z", "z"), ("g", "G")):
            known = good[np.isfinite(good[column])]
            x, y = known["rho"] - start["onset"], known[column]
            few = len(known) < _LEAST_POINTS
            row |= {
                f"{name}({d:g})": np.nan if few else np.interp(d, x, y, left=np.nan, right=np.nan)
                for d in DISTANCES[name]
            }
        ends = {"A": last["shape"], "A with rim": last["shape_rim"], "area deficit": 1 - last["area"] / start["area"]}
        confluent = last["rho"] > CONFLUENCE - _NEAR_CONFLUENCE
        rows.append(row | (ends if confluent else dict.fromkeys(ends, np.nan)))
    return pd.DataFrame(rows)


def sensitivity(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Average every observable over each set of parameters, and its change from the sweep "centre", seed by seed: a row
    per set and observable, with standard errors; in that of the change the scatter between seeds cancels."""
    if "centre" not in tables:
        raise InputError("there is no sweep 'centre' to compare with: run the whole scan")
    centre = tables["centre"].set_index("seed")
    found = {}
    for name, table in tables.items():
        here = table.set_index("seed")
        change = here - centre
        numbers = (here.mean(), here.sem(), change.mean(), change.sem())
        found[name] = pd.DataFrame(dict(zip(_NUMBERS, numbers, strict=True)) | {"packings": here.count()})
    return pd.concat(found, names=["set", "observable"]).reset_index()


@dataclass(frozen=True)
class Calibration:
    """Result of the fit."""

    law: dict[str, float]  # gamma (eps/l), ka (eps/l^4) and delta (l) that come closest to the paper
    predicted: dict[str, float]  # target observables with this law, as modelled
    misfit: float  # root mean square of the deviations in units of their tolerances
    misfit_at_centre: float  # the same at the centre of the scan
    # parameters that ended at the edge of the scan, a factor of 2 off the centre: scan again from there
    at_edge: tuple[str, ...]


def fit(changes: pd.DataFrame, centre: Mapping[str, float]) -> Calibration:
    """Find gamma, ka and delta within a factor of 2 of the centre that bring the changes closest to `TARGETS`."""
    table = changes.pivot(index="set", columns="observable", values="mean")
    needed = ["centre", *(f"{name}-{side}" for name in FITTED for side in _SIDES)]
    missing = [name for name in needed if name not in table.index]
    if missing:
        raise InputError(f"sweep {missing[0]!r} is missing: run the whole scan")
    names, (target, tolerance) = list(TARGETS), np.array([t[:2] for t in TARGETS.values()]).T
    values = table.loc[needed, names].to_numpy(dtype=np.float64)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise InputError(f"{names[column]} of sweep {needed[row]!r} was not measured: add seeds")
    at_centre, halved, doubled = values[0], values[1::2], values[2::2]  # x = 0, -1 and 1 in log2 of each parameter
    slope, bend = 0.5 * (doubled - halved), 0.5 * (doubled + halved) - at_centre

    def predict(x: Array) -> Array:
        return np.asarray(at_centre + x @ slope + x**2 @ bend)

    def misfit(x: Array) -> float:
        return float(np.mean(((predict(x) - target) / tolerance) ** 2))

    # the sum of squares may have several minima: start at the centre and half-way to each corner
    starts = [np.zeros(len(FITTED)), *(0.5 * np.array(list(product((-1, 1), repeat=len(FITTED)))))]
    found = min((minimize(misfit, x, bounds=[(-1, 1)] * len(FITTED)) for x in starts), key=lambda result: result.fun)
    law = {name: float(centre[name] * 2**x) for name, x in zip(FITTED, found.x, strict=True)}
    edge = tuple(name for name, x in zip(FITTED, found.x, strict=True) if abs(x) > 1 - 1e-6)
    predicted = dict(zip(names, predict(found.x).tolist(), strict=True))
    return Calibration(law, predicted, found.fun**0.5, misfit(np.zeros(len(FITTED))) ** 0.5, edge)


def open_scan(folder: Path, n: int = 32, seeds: int = 8, law: Mapping[str, float] | None = None) -> Campaign:
    """Open the scan of packings of n droplets, `seeds` for each law; `law` replaces defaults at its centre. Its file is
    written at first."""
    check_bidisperse(n, 0, 1.0)
    if seeds < 2:
        raise InputError(f"seeds = {seeds}: standard errors need 2 or more")
    text, file = campaign_text(n, seeds, law or {}), folder / "calibration.toml"
    make_folder(folder)
    if not file.exists() or file.read_text(encoding="utf-8") != text:
        with atomic_file(file) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return open_campaign(file)


def fit_scan(scan: Campaign, law: Mapping[str, float] | None = None) -> tuple[pd.DataFrame, Calibration]:
    """Read the sensitivities of a finished scan, and fit."""
    changes = sensitivity({sweep.name: observables(scan.table("states", sweep.name)) for sweep in scan.content.sweep})
    return changes, fit(changes, _centre(law or {}))


if __name__ == "__main__":
    scan = open_scan(Path(sys.argv[1] if len(sys.argv) > 1 else "calibration"))
    scan.run()
    found_changes, best = fit_scan(scan)
    print(found_changes.to_string(), best, *(f"{k}: {t.value:.4g}, {t.source}" for k, t in TARGETS.items()), sep="\n")
