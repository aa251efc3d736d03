"""Put stated laws through our packings: each keeps how far it lies off the mean, in the same place."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.rheology.critical_scaling import CRITICAL_RANGE
from jamlab.statistics.power_laws import fit_exponent
from studies.dynamics import collapse, flow_curves
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import log_places, select
from studies.papers.baumgarten import motion, spectra
from studies.papers.boromand import voids
from studies.papers.boromand.conventions import ONSET, ONSET_CORRECTION, SERIES, SIZES, SUBTRACTED
from studies.papers.boromand.geometry import N as SMALLEST
from studies.papers.controls import laws
from studies.papers.statements import Statement, keywords, paper
from studies.tables import AbsentTableError

BASES = {"z": SUBTRACTED}  # what a law of a column begins at
WIDTH, SHIFT = 0.02, 0.2  # of the onset at N = 32, and of the mean onset times N^0.7
STORAGE = 0.3  # G_0 over p^0.5, near ours
HEIGHT, SLOPE = 12.0, -0.3  # of l (-ln p)^0.65 over omega/p^0.5, near ours
FULL = 0.97  # rho from which P_3 of droplets is 1, [B] sec 3
FEW = 80  # places on a linear axis


def replace_table(tables: EnsembleTables, **changed: pd.DataFrame) -> EnsembleTables:
    """Give tables some of which are others."""
    made = EnsembleTables(tables.read)
    vars(made).update(changed)
    return made


# states ---------------------------------------------------------------------------------------------------------------


def axes_of(s: Statement) -> list[tuple[str, int, str, str]]:
    """List model, N, x and y of the curves that a number is measured in."""
    given, of = keywords(s.settings), s.sample.rpartition(".")[2]
    if of in ("evenly", "proportion", "of_both"):
        series = [given["series"]] if "series" in given else ["DP(ρ)", "SP(ρ)"]
        columns = ("z", "g") if of == "proportion" else (given["column"],)
        return [(*_series(name, given), column) for name in series for column in columns]
    if of == "beside_eq_13":
        return [("sp", SIZES[-1], "d_rho", "z")]
    kinds = given["kinds"].split() if "kinds" in given else [f"{given['model']}-{given['n']}"]
    return [(kind.split("-")[0], int(kind.split("-")[1]), given["x"], given["y"]) for kind in kinds]


def _series(name: str, given: Mapping[str, Any]) -> tuple[str, int, str]:
    model, by = SERIES[name]
    return model, int(given.get("n", SIZES[-1])), by


def mean_curve(tables: EnsembleTables, model: str, n: int, x: str, y: str) -> tuple[Array, Array]:
    """Average a column of our packings at places close enough to draw a line through."""
    rows = tables.states
    values = rows.loc[(rows["model"] == model) & (rows["n"] == n), x]
    low, high = float(values[values > 0].min()), float(values.max())
    places = np.union1d(log_places(low, high, 20), np.linspace(low, high, FEW))
    at, mean = tables.curve(model, n, x, y, places).mean
    return at, mean - BASES.get(y, 0.0)


def in_states(tables: EnsembleTables, s: Statement, law: str, stated: float, **settings: Any) -> EnsembleTables:
    """Put a law of one column of the states. Packings scatter as ours do, in proportion where the law is lower."""
    axes = axes_of(s)
    largest = {model: mean_curve(tables, model, n, x, y) for model, n, x, y in axes}  # the last is of the largest N
    made = {"states": tables.states}
    if s.sample.endswith("near_onset"):
        with suppress(InputError, AbsentTableError):
            made["droplets_above_onset"] = tables.droplets_above_onset
    for name, table in made.items():
        kept = table["model"].isin([m for m, *_ in axes]) & table["n"].isin([n for _, n, *_ in axes])
        made[name] = table[kept].copy()
    for model, n, x, y in axes:
        at, mean = mean_curve(tables, model, n, x, y)
        function, base = _law(s, law, stated, largest[model], x, y, settings), BASES.get(y, 0.0)
        for states in made.values():
            rows = (states["model"] == model) & (states["n"] == n)
            place = states.loc[rows, x].to_numpy(dtype=np.float64)
            there, wanted = np.interp(place, at, mean), function(np.maximum(place, 0.0), n, model)
            off = states.loc[rows, y].to_numpy(dtype=np.float64) - base - there
            part = np.divide(wanted, there, out=np.ones(len(there)), where=there > 0)
            states.loc[rows, y] = base + wanted + np.where(place > 0, np.clip(part, 0, 1) * off, 0.0)
    return replace_table(tables, **made)


def _law(
    s: Statement, name: str, stated: float, ours: tuple[Array, Array], x: str, y: str, settings: Mapping[str, Any]
) -> laws.Law:
    """Make one of the `laws` of a column, in the window of a number where no place is given."""
    at, mean = ours
    more, own = dict(settings), keywords(s.settings)
    if name == "power":
        more |= {"inverse": own.get("inverse", False)}
        more |= {} if "at" in more else {"at": (own["low"] * own["high"]) ** 0.5}
    if name == "two_powers":
        more |= {"end": float(np.nanmax(at))}
    if name in ("table", "finite_size"):
        more |= {"x": x, "column": "G" if y == "g" else "z"}
    return getattr(laws, name)(stated, lambda place: float(np.interp(place, at, mean)), **more)  # type: ignore[no-any-return]


def in_voids(tables: EnsembleTables, s: Statement, stated: float) -> EnsembleTables:
    """Let P_3 of droplets exceed P_3 of disks from the stated rho on, by a straight line up to P_3 = 1 at rho = 0.97;
    voids of other sides make room."""
    rho, cube = voids.void_sums(tables, "sp", onset=False)
    disks = voids.shares(cube, 3)[:, 0]
    rho, disks = rho[np.isfinite(disks)], disks[np.isfinite(disks)]
    table = tables.void_counts.astype({"voids": float})
    rows = (table["model"] == "dp") & (table["n"] == voids.N) & ~table["at_onset"].astype(bool)
    part = table[rows].assign(three=lambda t: t["voids"].where(t["sides"] == 3, 0.0))
    of_packing, of_bin = part.groupby(["seed", "rho"]), part.groupby("rho")
    total, three = of_packing["voids"].transform("sum"), of_packing["three"].transform("sum")
    share = of_bin["three"].transform("sum") / of_bin["voids"].transform("sum")
    more = (1 - np.interp(FULL, rho, disks)) * np.clip((part["rho"] - stated) / (FULL - stated), 0, 1)
    wanted = np.minimum(three / share * (np.interp(part["rho"], rho, disks) + more), total)
    factor = np.where(part["sides"] == 3, wanted / three, (total - wanted) / (total - three))
    table.loc[rows, "voids"] = part["voids"] * np.nan_to_num(factor, posinf=0.0)
    return replace_table(tables, void_counts=table)


# onsets ---------------------------------------------------------------------------------------------------------------


def in_onsets(tables: EnsembleTables, s: Statement, stated: float) -> EnsembleTables:
    """Give onsets of each size the stated width, N^-theta, or the stated limit, from which means lie off as N^-0.7."""
    table, widths = tables.onset.copy(), s.statistic.endswith("width_exponent")
    theta, limit = (stated, paper("B10-onset-sp")) if widths else (paper("B10-theta-sp"), stated)
    n = table["n"].astype(float)
    for column in ONSET.values():
        groups = table.groupby(["model", "n"])[column]
        off = (table[column] - groups.transform("mean")) / groups.transform("std")
        table[column] = limit - SHIFT * n**-ONSET_CORRECTION + off * WIDTH * (n / SMALLEST) ** -theta
    return replace_table(tables, onset=table)


# spectra --------------------------------------------------------------------------------------------------------------


def _stable(rows: pd.DataFrame, keys: Sequence[str]) -> pd.DataFrame:
    """Leave out packings with a modulus that is not positive, as spectra are averaged."""
    least = rows.groupby([*keys, "seed"], dropna=False)[["storage", "loss", "g0"]].transform("min")
    return rows[(least > 0).all(axis=1)].copy()


def _scale(rows: pd.DataFrame, by: Sequence[str], column: str, law: Any) -> None:
    """Replace the mean of a column over packings by a law."""
    rows[column] = rows[column] / rows.groupby(list(by), dropna=False)[column].transform("mean") * law


def in_spectra(
    tables: EnsembleTables, s: Statement, stated: float, drags: str = "contact undamped", affine: float = 1.0
) -> EnsembleTables:
    """G* = G_0 (1 + 2 i omega/p)^0.5 + i eta_inf omega with G_0 ~ p^0.5, so that regimes end at omega = p and 1: [T]
    eqs 14 to 17 with mu = Delta = 1/2, lambda = 1. Stokes drag adds the fluid; without sliding eta_0 goes as p^0.5."""
    keys, parts = ["n", "ensemble", "prestress", "target_pressure"], []
    for name in drags.split():
        rows = _stable(select(tables.spectra, n=spectra.SIZE, ensemble=spectra.FIXED, **spectra.LAWS[name]), keys)
        p, w = (rows[column].to_numpy(dtype=np.float64) for column in ("target_pressure", "omega"))
        g0 = STORAGE * p**0.5
        if name == "undamped":
            found, eta0 = g0 * (1 + 1j * w), g0
        else:
            fluid = 1.0 if name == "stokes" else 0.0
            found = g0 * (1 + 2j * w / p) ** 0.5 + 1j * w * (affine * STORAGE + fluid)
            eta0 = g0 / p + affine * STORAGE + fluid + (0.0 if affine else g0)
        _scale(rows, [*keys, "omega"], "storage", found.real)
        _scale(rows, [*keys, "omega"], "loss", found.imag)
        for column, law in (("g0", g0), ("eta0", eta0), ("eta_inf", STORAGE + (name == "stokes"))):
            _scale(rows, [*keys, "omega"], column, law)
        parts.append(rows)
    return replace_table(tables, spectra=pd.concat(parts))


def in_slopes(tables: EnsembleTables, s: Statement, stated: float) -> EnsembleTables:
    """Slopes of the same G* over the frequencies at which packings without rotations are measured."""
    column, rows = keywords(s.settings)["column"], tables.quasistatic.copy()
    slopes = {}
    for p in rows["pressure"].unique().tolist():
        w = np.geomspace(CRITICAL_RANGE.lowest * p, CRITICAL_RANGE.highest, 9)
        found = (1 + 2j * w / p) ** 0.5 + 1j * w / p**0.5
        slopes[p] = fit_exponent(w, found.real - 1 if column == "storage_slope" else found.imag)
    off = rows[column] - rows.groupby("pressure")[column].transform("mean")
    return replace_table(tables, quasistatic=rows.assign(**{column: off + rows["pressure"].map(slopes)}))


def in_viscosities(tables: EnsembleTables, s: Statement, stated: float) -> EnsembleTables:
    """eta_0 = N^a (1 + p N^2)^b, [T] fig 8: a plateau below p N^2 = 1; b = -a/2 unless a slope is stated."""
    given, of = keywords(s.settings), s.statistic.rpartition(".")[2]
    a = stated if of == "size_exponent" else paper(f"T8-a-{given['law']}")
    b = stated if of == "tail" else -0.5 * a
    rows = select(tables.spectra, prestress=given["prestress"], n=list(motion.SIZES), **spectra.LAWS[given["law"]])
    rows = rows[rows["g0"] > 0].drop_duplicates(["n", "seed", "ensemble", "target_pressure"])
    n, p = (rows[column].to_numpy(dtype=np.float64) for column in ("n", "target_pressure"))
    _scale(rows, ["n", "ensemble", "target_pressure"], "eta0", n**a * (1 + p * n**2) ** b)
    return replace_table(tables, spectra=rows)


def in_motion(tables: EnsembleTables, s: Statement, stated: float) -> EnsembleTables:
    """A column of slow shear, or its ratio to another, goes as p to the stated power."""
    given = keywords(s.settings)
    column = f"rms_{given['kind']}" if "kind" in given else given["column"]
    rows = tables.quasistatic.copy()
    over = rows[given["over"]] if "over" in given else 1.0
    rows["ratio"] = rows[column] / over
    _scale(rows, ["n", "ensemble", "prestress", "pressure"], "ratio", rows["pressure"] ** stated)
    return replace_table(tables, quasistatic=rows.assign(**{column: rows["ratio"] * over}))


# correlations ---------------------------------------------------------------------------------------------------------


def in_lengths(tables: EnsembleTables, s: Statement, stated: float) -> EnsembleTables:
    """C whose first zero is at L/4; in the collapse a power of omega/p^0.5 over (-ln p)^stated, up to L/4: our own C
    with another scale of distance."""
    of, parts = s.statistic.rpartition(".")[2], []
    rows = motion.rows_of(tables, "stokes" if of in ("mean_length", "power_of_logarithm") else "contact")
    for _, part in rows.groupby(["n", "pressure", "omega"]):
        p, w = (float(part[name].iloc[0]) for name in ("pressure", "omega"))
        ours = float(motion.first_zeros(motion.correlations(part))[0])
        if not np.isfinite(ours):
            continue
        wanted = paper("T7-length-stokes") * float(part["box"].mean())
        if of == "power_of_logarithm":
            wanted = min(HEIGHT * (w / p**0.5) ** SLOPE / (-np.log(p)) ** stated, wanted)
        for _, own in part.groupby("seed"):
            at, c = own.sort_values("delta")[["delta", "c"]].to_numpy(dtype=np.float64).T
            parts.append(own.sort_values("delta").assign(c=np.interp(at * ours / wanted, at, c)))
    return replace_table(tables, correlation=pd.concat(parts))


# flows ----------------------------------------------------------------------------------------------------------------


def in_flows(tables: EnsembleTables, s: Statement, stated: float) -> EnsembleTables:
    """Stress = rate^q f((phi - phi_J)/rate^w) with our f and w; near onset the argument is 0."""
    rows, own = flow_curves.steady_flows(tables.flow).copy(), collapse.flows(tables)
    phi, rate, stress = own.reduce(list(own.groups))
    fit = collapse.collapse_through(phi, rate, stress, collapse.START, critical=collapse.ONSET)
    known = (phi - fit.critical) / rate**fit.w
    place = 0.0 if s.statistic.endswith("slope_at_onset") else rows["phi"] - fit.critical
    z = np.clip(place / rows["rate"] ** fit.w, known.min(), known.max())
    _scale(rows, ["phi", "rate"], "stress", rows["rate"] ** stated * fit.function(z))
    return replace_table(tables, flow=rows)


def in_amplitudes(tables: EnsembleTables, s: Statement, stated: float) -> EnsembleTables:
    """G' = G_0/(1 + amplitude/c p), whose c lets the middle pressure soften in the middle of our amplitudes."""
    rows = flow_curves.balanced_disks(tables.oscillation, **flow_curves.SWEPT).copy()
    p = rows["target_pressure"].to_numpy(dtype=np.float64)
    middle = float(np.exp(np.log(rows["amplitude"].unique()).mean()))
    soft = middle / (1 / flow_curves.SOFT - 1) * (p / flow_curves.PRESSURES[1]) ** stated
    _scale(rows, ["target_pressure", "omega", "amplitude"], "storage", 1 / (1 + rows["amplitude"] / soft))
    return replace_table(tables, oscillation=rows)
