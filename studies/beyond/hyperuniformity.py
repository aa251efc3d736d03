"""A study of the structure of large packings of disks: spectra at long waves, and gaps between neighbours."""

from functools import partial
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.geometry.contact_network import remove_rattlers
from jamlab.packing.packing import Packing
from jamlab.plotting import in_unit
from jamlab.protocols.onset import jam
from jamlab.protocols.target_pressure import pack
from jamlab.statistics.power_laws import fit_power_law
from jamlab.structure.pair_correlation import pair_correlation
from jamlab.structure.spectral_density import spectral_density
from jamlab.structure.structure_factor import structure_factor
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, mean_over_packings, of_packings, select
from studies.panels import PAPER, Drawing, drawing, label, scale, style, write_interval
from studies.papers.statements import caption
from studies.study import Study

N, SEEDS = 1024, 20
PRESSURES = (0.0, 1e-5, 1e-1)  # 0: at onset
EDGES = np.geomspace(0.18, 14.0, 27)  # of shells, 1/d
GAPS = np.geomspace(1e-4, 0.3, 22)  # of gaps over the distance of contact
LONG, CLOSE = (0.19, 1.0), (1e-3, 0.1)  # wavenumbers and gaps to which powers are fitted
# exponents of chi_V at long waves of disks of ratio 1.4: strictly jammed, Maher & Torquato (2024), and soft, Dam et al.
# (2025); of gaps, Charbonneau et al. (2015)
MAHER, DAM, GAMMA = 0.45, (0.6, 0.7), 0.41269


def measure_structure(pressure: float, seed: int) -> list[dict[str, Any]]:
    """Measure chi_V, S and, at onset, g of gaps, of one packing."""
    packing = pack(N, pressure, seed, units="k") if pressure else jam(N, seed=seed, units="k")
    spectra = {
        "chi": spectral_density(packing, EDGES[-1]),
        "s": structure_factor(packing, EDGES[-1]),
    }
    rows = []
    for quantity, spectrum in spectra.items():
        shells = spectrum.shells(EDGES)
        place = np.sqrt(EDGES[1:] * EDGES[:-1])[np.searchsorted(EDGES, shells.k) - 1]
        rows += [{"quantity": quantity, "x": x, "value": y} for x, y in zip(place, shells.mean, strict=True)]
    if not pressure:
        middles = np.sqrt(GAPS[1:] * GAPS[:-1])
        rows += [{"quantity": "gap", "x": x, "value": y} for x, y in zip(middles, gaps_of(packing), strict=True)]
    return [{"pressure": pressure, "seed": seed, **row} for row in rows]


def gaps_of(packing: Packing) -> Array:
    """(m,) g of pairs whose gap lies in each bin of `GAPS`, the mean over pairs of sizes; rattlers are left out."""
    backbone = remove_rattlers(packing)
    small, large = np.unique(backbone.disk_diameters)
    total = np.zeros(len(GAPS) - 1)
    for a, b, contact, weight in ((0, 0, small, 1), (0, 1, 0.5 * (small + large), 2), (1, 1, large, 1)):
        total += weight * pair_correlation(backbone, contact * (1 + GAPS)).partial[a, b] / 4
    return total


def exponent(x: Array, low: float, high: float, groups: list[Array]) -> Array:
    """Exponent of the power law of means over packings (packings, m) in a window."""
    return fit_power_law(x, np.nanmean(groups[0], axis=0), low=low, high=high).exponents


def draw_structure(tables: EnsembleTables) -> Drawing:
    """Draw chi_V and S over the wavenumber for some pressures, and g over the gap near onset."""
    rows = tables.read("hyperuniformity")
    out, axes = drawing("hyperuniformity", 1, 3, 4.3, 3.8)
    scale(*axes)
    for k, pressure in enumerate(PRESSURES):
        own = select(rows, pressure=pressure)
        for part, quantity in zip(axes, ("chi", "s"), strict=False):
            x, values = of_packings(select(own, quantity=quantity), "x", "value")
            name = f"p = {pressure:g} k" if pressure else "onset"
            if quantity == "chi":
                found = bootstrap([values], partial(exponent, x, *LONG))
                out.values[f"exponent of chi_V, {name}"] = found[0]
                name += f": {write_interval(found[0])}"
            out.curve(part, name, x, mean_over_packings([values])[0], **style(k))
    x, values = of_packings(select(rows, quantity="gap"), "x", "value")
    found = bootstrap([values], partial(exponent, x, *CLOSE))
    out.values["exponent of gaps"] = found[0]
    out.curve(axes[2], f"exponent {write_interval(found[0])}", x, mean_over_packings([values])[0], **style(0))
    middle = np.geomspace(*LONG, 2)
    for name, height, power in (
        ("Maher & Torquato: 0.45", 4e-3, MAHER),
        ("Dam et al.: 0.6 to 0.7", 1.3e-4, np.mean(DAM)),
    ):
        look = PAPER | {"linestyle": ":" if power == MAHER else "--"}
        axes[0].plot(middle, height * (middle / LONG[0]) ** power, **look, label=name)
    close = np.geomspace(*CLOSE, 2)
    axes[2].plot(close, 6.0 * (close / CLOSE[0]) ** -GAMMA, **PAPER, label=f"Charbonneau et al.: -{GAMMA:.3f}")
    label(axes[0], in_unit("wavenumber $k$", "1/d"), in_unit(r"spectral density $\chi_V(k)$", "d²"), loc="upper left")
    label(axes[1], in_unit("wavenumber $k$", "1/d"), "structure factor $S(k)$", loc="upper left")
    label(axes[2], "gap over the distance of contact", "pair correlation $g$", loc="best")
    for part in axes[:2]:
        part.set_ylim(top=8 * part.get_ylim()[1])  # room for the legend
    counts = select(rows, quantity="chi").groupby("pressure")["seed"].nunique()
    out.caption = caption(out.name, n=N, made=counts.min(), low=LONG[0], high=LONG[1], near=CLOSE[0], far=CLOSE[1])
    return out


STUDY = Study(
    "hyperuniformity",
    "Fluctuations of the covered area at long waves, and gaps between neighbours",
    {f"{p:g} {seed}": partial(measure_structure, p, seed) for seed in range(1, SEEDS + 1) for p in PRESSURES},
    draw_structure,
)
