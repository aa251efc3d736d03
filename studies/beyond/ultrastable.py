"""A study of ultrastable packings of disks: onset, energy and moduli against how long sizes were swapped."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.engine.session import evaluate
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.hexatic_order import hexatic_order
from jamlab.packing.packing import Packing
from jamlab.plotting import in_unit
from jamlab.protocols.anneal import anneal
from jamlab.protocols.decompression import decompress
from jamlab.protocols.moduli import bulk_modulus, shear_modulus
from jamlab.protocols.relax_radii import relax_radii
from jamlab.protocols.swap_sizes import swap_sizes
from jamlab.protocols.target_pressure import pack
from jamlab.statistics.confidence import Interval
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import mean_over_packings, side_by_side
from studies.panels import PAPER, Drawing, drawing, label, scale, style
from studies.papers.statements import caption
from studies.study import Study

N, SEEDS = 256, 20
HEAT = (1e-2, 1e-6)  # of thermal annealing
START = 0.94  # phi at which sizes are swapped: above every onset
LOW, HIGH = 1e-5, 1e-3  # pressures, k: phi at the lower one is that of onset to 1e-4; moduli are of the higher one
SIZES = {"power-law:-3,0.4243,1": "power law, width 0.246", "lognormal:0.2": "lognormal, width 0.2"}
SWEEPS = (0, 30, 300, 3000, 30000)
LINES = {"0": "quenched", "radii": "transient radii", "thermal": "thermal annealing"}
WAYS = (*map(str, SWEEPS), "radii", "thermal")
COLUMNS = {
    "phi_J": r"onset $\phi_J$",
    "energy": in_unit("energy a disk", "k d²"),
    "g": in_unit("shear modulus $G$", "k"),
    "b": in_unit("bulk modulus $B$", "k"),
}
# largest onset of disks of the power law after swaps of many at once: Ghimenti, Berthier & van Wijland, Phys. Rev.
# Lett. 133, 028202 (2024), as Zaccone, arXiv:2502.03354, cites it
PUBLISHED = 0.905


def measure_stable(sizes: str, seed: int) -> list[dict[str, Any]]:
    """Measure packings of one random start, quenched and made by each of the other ways."""
    start = pack(N, phi=START, seed=seed, sizes=sizes)
    made: dict[str, Packing] = {"0": start}
    made |= {str(sweeps): swap_sizes(start, sweeps=sweeps, seed=seed).packing for sweeps in SWEEPS[1:]}
    made |= {"radii": relax_radii(start), "thermal": anneal(start, HEAT, seed=seed).packing}
    return [{"sizes": sizes, "seed": seed, "way": way, **_measure(packing)} for way, packing in made.items()]


def _measure(packing: Packing) -> dict[str, Any]:
    high = decompress(packing, HIGH)
    low = decompress(high, LOW)
    network = contacts(low)
    return {
        "energy": evaluate(packing).energy / packing.n,
        "phi_J": low.phi,
        "z": network.z,
        "rattlers": float(network.rattlers.mean()),
        "g": shear_modulus(high),
        "b": bulk_modulus(high),
        "hexatic": hexatic_order(low).mean_local,
    }


def draw_stable(tables: EnsembleTables) -> Drawing:
    """Draw onset, energy, G and B against the number of sweeps, those of quenches and of the other ways as lines."""
    rows = tables.read("ultrastable")
    out, axes = drawing("ultrastable", 2, 2, 4.8, 3.8)
    scale(*axes, y="linear")
    scale(axes[1])
    for panel, (column, title) in zip(axes, COLUMNS.items(), strict=True):
        for k, (sizes, name) in enumerate(SIZES.items()):
            found = _means(rows[rows["sizes"] == sizes], column)
            for way, mean in found.items():
                out.values[f"{column}, {name}, {LINES.get(way, f'{way} sweeps')}"] = mean
            swaps = [way for way in found if way not in LINES]
            curve = side_by_side(found[way] for way in swaps)
            out.curve(panel, f"swaps, {name}", [int(way) for way in swaps], curve, band=False, **style(k))
            for dashes, way in zip(("--", ":", "-."), LINES, strict=True):
                level = np.full(2, float(found[way].value))
                text = f"{LINES[way]}, {name}" if panel is axes[0] else None
                look = {"color": style(k)["color"], "linestyle": dashes, "linewidth": 0.9, "marker": ""}
                out.curve(panel, f"{LINES[way]}, {name}", [SWEEPS[1], SWEEPS[-1]], level, label=text, **look)
        label(panel, "sweeps", title, legend=False)
    axes[0].axhline(PUBLISHED, color=PAPER["color"], linewidth=1.3, label=f"{PUBLISHED}, Ghimenti et al.")
    out.legend_above(axes[0], fontsize=7, ncols=2)
    counts = rows.groupby(["sizes", "way"]).size()
    numbers = {"n": N, "made": counts.min(), "start": START, "low": LOW, "high": HIGH}
    out.caption = caption(out.name, **numbers, hexatic=float(rows["hexatic"].max()))
    return out


def _means(rows: pd.DataFrame, column: str) -> dict[str, Interval]:
    """Means over packings by the way that they were made."""
    groups = {way: rows.loc[rows["way"] == way, column].to_numpy(dtype=float) for way in WAYS}
    found = mean_over_packings(list(groups.values()))
    return {way: found[k] for k, way in enumerate(groups)}


STUDY = Study(
    "ultrastable",
    "Ultrastable packings: onset, energy and moduli against how long sizes are swapped",
    {f"{sizes} {seed}": partial(measure_stable, sizes, seed) for seed in range(1, SEEDS + 1) for sizes in SIZES},
    draw_stable,
)
