"""A study of vibrations: omega* against pressure, and quasi-localised modes of several N."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.density_by_size import density_by_size
from jamlab.mechanics.quasilocalized_modes import QuasilocalizedModes, quasilocalized_modes
from jamlab.mechanics.vibrations import lowest_modes
from jamlab.packing.packing import Packing
from jamlab.plotting import in_unit
from jamlab.protocols.target_pressure import pack
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, mean_over_packings
from studies.panels import Drawing, TextTable, drawing, label, scale, style, write_interval
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

NAME = "soft-modes"
PARTICLES, PRESSURES, SEEDS = 512, (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4), 24
EDGES = np.geomspace(1e-2, 4.0, 27)
PLATEAU = (0.3, 1.0)  # frequencies over which the height of the plateau is a mean
DENSE = 0.1  # pressure of the packings whose quasi-localised modes are found
SIZES = {64: 240, 256: 120, 1024: 40}  # N -> packings
LOW = 0.25  # share of packings, of the lowest frequencies, to which a power is fitted
BLOCK, STARTS = 20, 16  # packings of a task; harmonic modes that minimisation starts from


def measure_density(pressure: float, seed: int) -> list[dict[str, Any]]:
    """Density of states of unstressed contacts, without rattlers, bin by bin."""
    packing = pack(PARTICLES, pressure, seed)
    found = density_by_size([packing], EDGES, rattlers=False, prestress=False)
    row = {"n": PARTICLES, "pressure": pressure, "seed": seed, "z": contacts(packing).z}
    (density,) = found.densities
    return [{**row, "omega": w, "density": d} for w, d in zip(density.omega, density.density, strict=True)]


def measure_localised(n: int, first: int) -> list[dict[str, Any]]:
    """The softest quasi-localised mode and the lowest harmonic mode of every packing of a block."""
    rows = []
    for seed in range(first, first + BLOCK):
        packing = pack(n, DENSE, seed)
        modes = lowest_modes(packing, 2 * STARTS)
        found = quasilocalized_modes(packing, STARTS)
        lowest = np.flatnonzero(~modes.zero)[0]
        row = {"omega": found.frequencies[0], "participation": found.participation[0], "minima": len(found.cost)}
        row |= {"harmonic": modes.frequencies[lowest], "harmonic_participation": modes.participation[lowest]}
        row |= _between_pairs(packing, found)
        rows.append({"n": n, "pressure": DENSE, "seed": seed, "residual": found.residual.max(), **row})
    return rows


def _between_pairs(packing: Packing, found: QuasilocalizedModes) -> dict[str, float]:
    """Pairs in contact that take part in the softest mode, (sum z_ij^2)^2/sum z_ij^4, and its frequency where the sum
    of z_ij^2 is 1 instead of that of z_i^2: the far field of a mode counts less."""
    pairs, z = packing.kind.pairs(packing), found.vectors[0]
    apart = ((z[pairs.j] - z[pairs.i]) ** 2).sum(axis=1)
    total = float(apart.sum())
    return {"pairs": total**2 / float((apart**2).sum()), "pair_omega": float(found.frequencies[0]) / total**0.5}


def _tasks() -> dict[str, Task]:
    density = {f"density {p:g} {s}": partial(measure_density, p, s) for p in PRESSURES for s in range(1, SEEDS + 1)}
    blocks = [(n, first) for n, made in SIZES.items() for first in range(1, made + 1, BLOCK)]
    return density | {f"localised {n} {first}": partial(measure_localised, n, first) for n, first in blocks}


def onset_frequency(omega: Array, densities: Array) -> float:
    """omega*: where the mean of D (packings, m) falls, from its plateau down, to a quarter of its height."""
    mean = densities.mean(axis=0)
    height = mean[(omega > PLATEAU[0]) & (omega < PLATEAU[1])].mean()
    below = np.flatnonzero(mean[omega < PLATEAU[1]] < 0.25 * height)
    if not len(below):
        return float("nan")
    k = below[-1]
    share = (0.25 * height - mean[k]) / (mean[k + 1] - mean[k])
    return float(np.exp(np.log(omega[k]) + share * np.log(omega[k + 1] / omega[k])))


def weibull_shape(values: Array, share: float) -> float:
    """Shape of a Weibull law by maximum likelihood from the lowest share of values (m,), of the others that they are
    higher. The lowest of many frequencies of density omega^beta has the shape beta + 1."""
    from scipy.optimize import brentq

    ordered = np.sort(values)
    known = max(3, round(share * len(ordered)))
    logs = np.log(np.minimum(ordered, ordered[known - 1]) / ordered[known - 1])
    mean = logs[:known].mean()

    def slope(shape: float) -> float:
        weight = np.exp(shape * logs)
        return float((weight @ logs) / weight.sum() - 1 / shape - mean)

    return float(brentq(slope, 0.05, 500.0))


def _exponent_of_lowest(share: float, groups: Sequence[Array]) -> float:
    return weibull_shape(groups[0], share) - 1


def _slope(x: Array, y: Array) -> float:
    known = np.isfinite(y) & (y > 0)
    return float(np.polyfit(np.log(x[known]), np.log(y[known]), 1)[0])


def draw_soft_modes(tables: EnsembleTables) -> Drawing:
    """Draw D(omega) and omega* over pressure; the lowest frequencies and participation of quasi-localised modes."""
    rows = tables.read(NAME)
    out, axes = drawing(NAME, 2, 2, 5.0, 4.0)
    scale(*axes)
    _draw_density(out, axes[:2], rows[rows["density"].notna()])
    lows = rows[rows["harmonic"].notna()]
    _draw_localised(out, axes[2:], lows)
    out.text = [TextTable(("quantity", "here", "published", "source"), _published(out), words=True)]
    counts = lows.groupby("n").size()
    out.caption = caption(NAME, n=PARTICLES, made=SEEDS, p=DENSE, few=counts.min(), most=counts.max(), starts=STARTS)
    return out


def _draw_density(out: Drawing, axes: list[Any], rows: pd.DataFrame) -> None:
    groups, excess = [], []
    for k, pressure in enumerate(PRESSURES):
        table = rows[rows["pressure"] == pressure]
        wide = table.pivot_table(index="seed", columns="omega", values="density")
        groups.append(wide.to_numpy())
        excess.append(table.groupby("seed")["z"].mean().to_numpy())
        omega = wide.columns.to_numpy(dtype=float)
        out.curve(axes[0], f"p = {pressure:g} k", omega, mean_over_packings(list(groups[-1].T)), **style(k))
    pressures = np.array(PRESSURES)
    stars = bootstrap(groups, lambda drawn: np.array([onset_frequency(omega, each) for each in drawn]))
    out.curve(axes[1], r"$\omega^*$", pressures, stars, band=False, **style(0))
    near = (pressures < 0.05) & (pressures * PARTICLES**2 > 50)  # a plateau down to omega*, and N large enough
    chosen = [g for g, kept in zip(groups, near, strict=True) if kept]
    out.values["exponent of omega* over p"] = bootstrap(
        chosen, lambda drawn: _slope(pressures[near], np.array([onset_frequency(omega, each) for each in drawn]))
    )
    isostatic = 4 * (1 - 1 / PARTICLES)
    gaps = np.array([each.mean() - isostatic for each in excess])
    out.values["exponent of omega* over z - z_iso"] = bootstrap(
        chosen, lambda drawn: _slope(gaps[near], np.array([onset_frequency(omega, each) for each in drawn]))
    )
    out.slope(axes[1], 0.5, (1e-3, 1e-2), 0.5 * float(stars.value[3]))
    label(
        axes[0],
        in_unit(r"frequency $\omega$", r"$\sqrt{k/m}$"),
        in_unit(r"density of states $D(\omega)$", r"$\sqrt{m/k}$"),
        loc="best",
    )
    label(
        axes[1], in_unit("pressure $p$", "k"), in_unit(r"crossover frequency $\omega^*$", r"$\sqrt{k/m}$"), loc="best"
    )


def _draw_localised(out: Drawing, axes: list[Any], rows: pd.DataFrame) -> None:
    share, sizes = 1 / 5, np.array([*SIZES])
    for k, n in enumerate(SIZES):
        table = rows[rows["n"] == n]
        ordered = np.sort(table["omega"].to_numpy())
        rank = (np.arange(len(ordered)) + 0.5) / len(ordered)
        out.curve(axes[0], f"N = {n}", ordered * n**share, rank, **style(k))
        for column, name in (("omega", "quasi-localised"), ("harmonic", "harmonic")):
            values = table[column].to_numpy()
            for part, all_of in (("", LOW), (" of all", 1.0)):
                shape = bootstrap([values], partial(_exponent_of_lowest, all_of))
                out.values[f"beta{part}, {name}, N = {n}"] = shape
    for k, (column, name) in enumerate((("participation", "quasi-localised"), ("harmonic_participation", "harmonic"))):
        groups = [rows.loc[rows["n"] == n, column].to_numpy() for n in SIZES]
        out.curve(axes[1], name, sizes, mean_over_packings(groups), band=False, **style(k))
        found = bootstrap(groups, lambda drawn: _slope(sizes, np.array([each.mean() for each in drawn])))
        out.values[f"exponent of P over N, {name}"] = found
    for column, name in {
        "omega": "the lowest frequency",
        "pair_omega": "the lowest frequency over relative displacements",
        "pairs": "pairs that take part",
    }.items():
        groups = [rows.loc[rows["n"] == n, column].to_numpy() for n in SIZES]
        found = bootstrap(groups, lambda drawn: _slope(sizes, np.array([each.mean() for each in drawn])))
        out.values[f"exponent of {name} over N"] = found
        out.values |= {
            f"mean of {name}, N = {n}": mean_over_packings([g])[0] for n, g in zip(SIZES, groups, strict=True)
        }
    for exponent, start in ((5.0, 0.4), (4.5, 0.64)):
        out.slope(axes[0], exponent, (start, 1.5 * start), 0.005)
    label(axes[0], in_unit(r"$\omega_{\min} N^{1/5}$", r"$\sqrt{k/m}$"), "share of packings below", loc="best")
    label(axes[1], "number of disks $N$", "participation ratio", loc="best")


def _published(out: Drawing) -> list[tuple[str, ...]]:
    def here(name: str) -> str:
        return write_interval(out.values[name])

    beta = "; ".join(f"N = {n}: {here(f'beta, quasi-localised, N = {n}')}" for n in SIZES)
    return [
        (
            "ω* ~ p^a, unstressed",
            here("exponent of omega* over p"),
            "1/2",
            "Wyart, Nagel & Witten 2005; Silbert et al. 2005",
        ),
        ("ω* ~ (z - z_iso)^a", here("exponent of omega* over z - z_iso"), "1", "Wyart, Nagel & Witten 2005"),
        ("D ~ ω^β of the softest", beta, "4; 3.5", "Kapteijns et al. 2018; Wang, Szamel & Flenner 2023"),
        (
            "P ~ N^a, quasi-localised",
            here("exponent of P over N, quasi-localised"),
            "-1 in 3D",
            "Lerner, Düring & Bouchbinder 2016",
        ),
        ("pairs that take part ~ N^a", here("exponent of pairs that take part over N"), "0 where localised", ""),
        ("lowest ω ~ N^a", here("exponent of the lowest frequency over N"), "-1/5 for β = 4", "Lerner et al. 2016"),
        (
            "the same over relative displacements",
            here("exponent of the lowest frequency over relative displacements over N"),
            "-1/5 for β = 4",
            "",
        ),
    ]


STUDY = Study(NAME, "Soft modes: ω* over pressure, quasi-localised modes over N", _tasks(), draw_soft_modes)
