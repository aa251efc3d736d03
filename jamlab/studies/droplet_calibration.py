"""Calibrate the droplets' force law, which Boromand et al. do not print, against their tables 1 and 2.

A campaign scans the parameters: gamma, ka and delta are halved and doubled in turn, and the number of vertices is
doubled; each time the same seeds are compressed from onset to rho = 0.99. Every observable is read off at fixed
distances from onset. Its changes between sweeps are the sensitivity of the model. For the fit, every observable is
modelled as a sum of parabolas, one in log2 of each parameter through its three points, and the parameters are chosen
that bring all of them closest to the paper.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.optimize import minimize

from jamlab.arrays import Array
from jamlab.checks import check_bidisperse
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.figures.html_page import TextTable
from jamlab.statistics.published_numbers import SHAPE_AT_CONFLUENCE, table_contacts, table_modulus
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.studies.study import CampaignStudy, Shown

if TYPE_CHECKING:
    import pandas as pd

    from jamlab.campaign.campaign import Campaign


FITTED = ("gamma", "ka", "delta")
CONFLUENCE = 0.99  # true packing fraction at which sweeps end and droplets count as confluent
DISTANCES = {"z": (0.05, 0.1), "G": (0.05, 0.1, 0.15)}  # rho - rho_J; further up z is limited to 6, table 1 is not
_NEAR_CONFLUENCE = 0.002  # in rho, a fifth of a step; a sweep that ends earlier is not confluent
_LEAST_POINTS = 3  # states of a sweep below which interpolation between them is not trusted


@dataclass(frozen=True)
class Target:
    """Value of one observable in the paper.

    Attributes:
        value: from a fit or a figure of Boromand et al.
        tolerance: deviation that counts as one unit of misfit.
        source: where it is printed.
    """

    value: float
    tolerance: float
    source: str


def _target_at(name: str, distance: float) -> Target:
    if name == "z":
        return Target(table_contacts("DP(ρ)", distance), 0.1, "table 1")
    value = table_modulus("DP(ρ)", distance)
    return Target(value, 0.1 * value, "table 2")


TARGETS: Mapping[str, Target] = {
    **{f"{name}({d:g})": _target_at(name, d) for name, distances in DISTANCES.items() for d in distances},
    "A": Target(SHAPE_AT_CONFLUENCE.value, 0.01, "fig 4c, at confluence"),
    "area deficit": Target(0.0, 0.01, "fig 11c: constant"),
}


def campaign_text(n: int, seeds: int, law: Mapping[str, float] | None = None) -> str:
    """Write the campaign file of the scan: the default law, and each parameter halved and doubled.

    Args:
        n: number of droplets in each packing, even.
        seeds: number of packings for each set of parameters.
        law: values that replace the defaults at the centre of the scan.

    Raises:
        InputError: a parameter cannot be varied.
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
    """Read off the observables to compare, one row per packing.

    Args:
        states: table "states" of one sweep of `campaign_text`.

    Returns:
        Columns seed, rho_J, z(d) and G(d) at the `DISTANCES`, A of the bare outline, A with rim, and area deficit
        1 - a/a_J, the last three at the last state. Values between two states are interpolated; unstable states have
        no G.
    """
    import pandas as pd

    rows = []
    for (_, seed), sweep in states.groupby(["n", "seed"]):
        good = sweep[sweep["converged"].astype(bool)].sort_values("rho")
        start = sweep[sweep["state"] == 0].iloc[0]
        distance = (good["rho"] - start["onset"]).to_numpy()
        row: dict[str, Any] = {"seed": seed, "rho_J": start["onset"]}
        for column, name in (("z", "z"), ("g", "G")):
            row |= {f"{name}({d:g})": _interpolate(d, distance, good[column].to_numpy()) for d in DISTANCES[name]}
        last = good.iloc[-1]
        confluent = last["rho"] > CONFLUENCE - _NEAR_CONFLUENCE
        row["A"] = last["shape"] if confluent else np.nan
        row["A with rim"] = last["shape_rim"] if confluent else np.nan
        row["area deficit"] = 1 - last["area"] / start["area"] if confluent else np.nan
        rows.append(row)
    return pd.DataFrame(rows)


def _interpolate(d: float, distance: Array, values: Array) -> float:
    known = np.isfinite(values)
    if known.sum() < _LEAST_POINTS:
        return float("nan")
    return float(np.interp(d, distance[known], values[known], left=np.nan, right=np.nan))


def sensitivity(tables: Mapping[str, "pd.DataFrame"]) -> "pd.DataFrame":
    """Average every observable over each set of parameters, and its change from the centre over the same seeds.

    Args:
        tables: name of the sweep -> its `observables`; must contain "centre".

    Returns:
        One row per set and observable: mean, its standard error, change, the standard error of the change (both from
        packings of equal seed, so that the scatter between seeds cancels), and the number of packings.

    Raises:
        InputError: there is no sweep "centre".
    """
    import pandas as pd

    if "centre" not in tables:
        raise InputError("there is no sweep 'centre' to compare with: run the whole scan")
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
        law: gamma (eps/l), ka (eps/l^4) and delta (l) that come closest to the paper.
        predicted: target observables with this law, as modelled.
        misfit: root mean square of the deviations in units of their tolerances.
        misfit_at_centre: the same at the centre of the scan.
        at_edge: parameters that ended at the edge of the scan, a factor of 2 off the centre: scan again from there.
    """

    law: dict[str, float]
    predicted: dict[str, float]
    misfit: float
    misfit_at_centre: float
    at_edge: tuple[str, ...]


def fit(changes: "pd.DataFrame", centre: Mapping[str, float]) -> Calibration:
    """Find gamma, ka and delta within a factor of 2 of the centre that come closest to `TARGETS`.

    Args:
        changes: from `sensitivity`.
        centre: parameters of the sweep "centre".

    Raises:
        InputError: a sweep is missing, or an observable was not measured.
    """
    table = changes.pivot(index="set", columns="observable", values="mean")
    needed = ["centre", *(f"{name}-{side}" for name in FITTED for side in ("halved", "doubled"))]
    missing = [name for name in needed if name not in table.index]
    if missing:
        raise InputError(f"sweep {missing[0]!r} is missing: run the whole scan")
    names = list(TARGETS)
    values = table.loc[needed, names].to_numpy(dtype=np.float64)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise InputError(f"{names[column]} of sweep {needed[row]!r} was not measured: add seeds")
    at_centre, halved, doubled = values[0], values[1::2], values[2::2]  # x = 0, -1 and 1 in log2 of each parameter
    slope, bend = 0.5 * (doubled - halved), 0.5 * (doubled + halved) - at_centre
    target = np.array([TARGETS[name].value for name in names])
    tolerance = np.array([TARGETS[name].tolerance for name in names])

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


@dataclass(frozen=True)
class DropletCalibration(CampaignStudy):
    """The scan and the fit, as a study.

    Attributes:
        n: number of droplets in each packing.
        seeds: number of packings for each set of parameters.
        law: values that replace the defaults at the centre of the scan.
    """

    name: str = "droplet-calibration"
    title: str = "Line tension, stiffness and rim of droplets that meet tables 1 and 2 of Boromand et al."
    n: int = 32
    seeds: int = 8
    law: Mapping[str, float] = field(default_factory=dict)
    kind: ClassVar[str] = "calibration"

    def campaign(self, folder: Path) -> "Campaign":
        """Open the scan; its file is written at first.

        Raises:
            InputError: n, seeds or law is invalid.
            StorageError: the folder cannot be written.
        """
        from jamlab.campaign.campaign import open_campaign

        check_bidisperse(self.n, 0, 1.0)
        if self.seeds < 2:
            raise InputError(f"seeds = {self.seeds}: standard errors need 2 or more")
        text = campaign_text(self.n, self.seeds, self.law)
        make_folder(folder)
        file = folder / "calibration.toml"
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            with atomic_file(file) as temporary:
                temporary.write_text(text, encoding="utf-8")
        return open_campaign(file)

    def fit(self, folder: Path) -> "tuple[pd.DataFrame, Calibration]":
        """Read the sensitivities of a finished scan, and fit.

        Raises:
            InputError: too few packings reached an observable.
        """
        campaign = self.campaign(folder)
        tables = {sweep.name: observables(campaign.table("states", sweep.name)) for sweep in campaign.content.sweep}
        changes = sensitivity(tables)
        centre = {name: float(defaults("dp")[name]) for name in FITTED} | dict(self.law)
        return changes, fit(changes, centre)

    def draw(self, folder: Path | None = None) -> Shown:
        """Show sensitivities and fit of a finished scan; none ships.

        Raises:
            InputError: no folder is given, or too few packings reached an observable.
        """
        if folder is None:
            raise InputError(f"{self.name} ships no results: give the folder of jamlab study run {self.name}")
        changes, found = self.fit(folder)
        return Shown(None, self.words(found), [self.changes_as_text(changes), targets_as_text(found)], changes)

    def words(self, found: Calibration) -> str:
        """The law that was found, and how well it meets the targets."""
        law = ", ".join(f"{name} = {value:.4g}" for name, value in found.law.items())
        return f"nearest: {law}; misfit {found.misfit:.2f} tolerances, {found.misfit_at_centre:.2f} with the defaults"

    def changes_as_text(self, changes: "pd.DataFrame") -> TextTable:
        """What each parameter changes."""
        columns = ["set", "observable", "mean", "error", "change", "change_error"]
        rows = [[row[0], row[1], *(f"{v:.4g}" for v in row[2:])] for row in changes[columns].itertuples(index=False)]
        heading = f"droplets, n = {self.n}, {self.seeds} seeds: each parameter halved and doubled"
        return TextTable(columns, rows, heading)


def targets_as_text(found: Calibration) -> TextTable:
    """Observables of the paper beside those of the law that was found."""
    rows = [
        [name, f"{t.value:.4g}", f"{t.tolerance:.2g}", f"{found.predicted[name]:.4g}", t.source]
        for name, t in TARGETS.items()
    ]
    return TextTable(["observable", "paper", "tolerance", "fit", "source"], rows)
