"""A study of what the sizes of disks and droplets change: onset, and contacts, G and G* at one distance above it."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arguments.choices import Registered
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.plotting import in_unit
from jamlab.protocols.compression import compress
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.protocols.size_distributions import SizeDistribution
from jamlab.rheology.complex_modulus import complex_modulus
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import FEWEST, mean_over_packings
from studies.panels import FREQUENCY, Drawing, drawing, label, model_style, scale, style
from studies.papers.statements import caption
from studies.study import Study

DISTANCE = 0.01  # above the onset of each packing, in phi
OMEGA = (1e-3, 1e-2, 1e-1, 1.0)
PARTICLES = {"sp": 128, "dp": 32}
_NAMES = {"sp": "disks", "dp": "droplets"}
SEEDS, BLOCK = 20, 10  # packings of a distribution, and of one task
_MIXED = {"sp": ((1.4, 2.0, 4.0), (0.1, 0.25, 0.5, 0.8)), "dp": ((1.4, 2.0), (0.25, 0.5, 0.75))}
_WIDTHS = {"sp": (0.1, 0.2, 0.3, 0.5, 0.7), "dp": (0.1, 0.2, 0.3, 0.5)}


def measure_sizes(model: str, sizes: str, first: int) -> list[dict[str, Any]]:
    """Measure packings of one distribution: phi_J, and z, G and G* at `DISTANCE` above, nan where none is held."""
    seeds = range(first, first + BLOCK)
    return [{"model": model, "sizes": sizes, "seed": seed, **_measure(model, sizes, seed)} for seed in seeds]


def _measure(model: str, sizes: str, seed: int) -> dict[str, Any]:
    found: dict[str, Any] = {}
    try:
        onset = jam(PARTICLES[model], Registered(model), seed, sizes=sizes, start="from-disks")
        found |= {"phi_J": onset.phi, "rattlers": float(contacts(onset).rattlers.mean())}
        *_, state = compress(onset, onset.phi + DISTANCE, 0.25 * DISTANCE, by="phi")
        spectrum = complex_modulus(state, OMEGA)
        return found | {
            "z": contacts(state).z,
            "g": shear_modulus(state),
            **{f"storage_{w:g}": float(s) for w, s in zip(OMEGA, spectrum.storage, strict=True)},
            **{f"loss_{w:g}": float(s) for w, s in zip(OMEGA, spectrum.loss, strict=True)},
        }
    except ConvergenceError as error:
        return found | {"note": str(error)}


def draw_sizes(tables: EnsembleTables) -> Drawing:
    """Draw onset against mixing, ratio and width; z, G and G* above it against the width of all distributions."""
    rows = tables.read("polydispersity")
    laws = [SizeDistribution.of(sizes) for sizes in rows["sizes"]]
    rows = rows.assign(width=[law.width for law in laws], large=[(0.0, *law.numbers)[-1] for law in laws])
    out, axes = drawing("polydispersity", 2, 3, 4.3, 3.6)
    for part, model in zip(axes, PARTICLES, strict=False):
        for k, ratio in enumerate(_MIXED[model][0]):
            two = rows[(rows["model"] == model) & rows["sizes"].str.startswith(f"bidisperse:{ratio:g},")]
            _draw(out, part, f"ratio {ratio:g}", two, "phi_J", style(k), "large")
        title = rf"$\phi_J$ of {PARTICLES[model]} {_NAMES[model]}"
        label(part, "share of large ones by number", title, loc="best")
        one = rows[rows["model"] == model]
        _draw(
            out,
            axes[2],
            _NAMES[model],
            one[~one["sizes"].str.startswith("bidisperse")],
            "phi_J",
            model_style(model, linestyle="-"),
        )
        for panel, column in zip(axes[3:], ("z", "g"), strict=False):
            _draw(out, panel, _NAMES[model], one, column, model_style(model))
    above = rf"$\phi_J + {DISTANCE:g}$"
    label(axes[2], "width of the lognormal", r"onset $\phi_J$", loc="best")
    label(axes[3], "width of the sizes", f"coordination $z$ at {above}", loc="best")
    label(axes[4], "width of the sizes", in_unit(f"$G$ at {above}", "SP: ε/d², DP: ε/l²"), loc="best")
    scale(axes[5])
    for k, sizes in enumerate(("monodisperse", "lognormal:0.1", "lognormal:0.3", "lognormal:0.7")):
        of_sizes = rows[(rows["model"] == "sp") & (rows["sizes"] == sizes)].dropna(subset="z")
        size = [np.hypot(*(of_sizes[f"{part}_{w:g}"].to_numpy() for part in ("storage", "loss"))) for w in OMEGA]
        if len(of_sizes) >= FEWEST:
            out.curve(axes[5], sizes, OMEGA, mean_over_packings(size), **style(k))
    label(axes[5], FREQUENCY, in_unit(f"$|G^*|$ of disks at {above}", "ε/d²"), loc="best")
    counts = rows.groupby(["model", "sizes"]).size()
    made = {"few": counts.min(), "most": counts.max(), "kinds": len(counts), "rows": len(rows)}
    out.caption = caption(out.name, loose=int(rows["z"].isna().sum()), at=DISTANCE, **PARTICLES, **made)
    return out


def _draw(
    out: Drawing, axes: Any, name: str, rows: pd.DataFrame, column: str, look: dict[str, Any], x: str = "width"
) -> None:
    """Draw the mean over packings of a column for some distributions, over their width or their share of large ones."""
    ordered = rows.dropna(subset=column).sort_values(x, kind="stable")
    kept = [part for _, part in ordered.groupby("sizes", sort=False) if len(part) >= FEWEST]
    if kept:
        mean = mean_over_packings([part[column].to_numpy() for part in kept])
        out.curve(axes, name, [part[x].iloc[0] for part in kept], mean, band=False, **look)


_KINDS = [
    *((m, f"bidisperse:{r:g},{share:g}") for m, (ratios, shares) in _MIXED.items() for r in ratios for share in shares),
    *((model, "monodisperse") for model in PARTICLES),
    *((model, f"lognormal:{width:g}") for model, widths in _WIDTHS.items() for width in widths),
]
STUDY = Study(
    "polydispersity",
    "What sizes change: onset, contacts and moduli against ratio, mixing and width",
    {
        f"{model} {sizes} {first}": partial(measure_sizes, model, sizes, first)
        for first in range(1, SEEDS + 1, BLOCK)
        for model, sizes in _KINDS
    },
    draw_sizes,
)
