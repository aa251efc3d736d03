"""A study of ultrastable packings of disks: onset, energy and moduli against how long sizes were swapped."""

from functools import partial
from typing import Any

from jamlab.engine.session import evaluate
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.hexatic_order import hexatic_order
from jamlab.packing.packing import Packing
from jamlab.protocols.anneal import anneal
from jamlab.protocols.decompression import decompress
from jamlab.protocols.moduli import bulk_modulus, shear_modulus
from jamlab.protocols.relax_radii import relax_radii
from jamlab.protocols.swap_sizes import swap_sizes
from jamlab.protocols.target_pressure import pack
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import mean_over_packings
from studies.panels import Drawing, drawing, label, style
from studies.papers.statements import caption
from studies.study import Study

N, SEEDS = 256, 20
START = 0.94  # phi at which sizes are swapped: above every onset
LOW, HIGH = 1e-5, 1e-3  # pressures, k: phi at the lower one is that of onset to 1e-4; moduli are of the higher one
SIZES = {"power-law:-3,0.4243,1": "power law, width 0.246", "lognormal:0.2": "lognormal, width 0.2"}
SWEEPS = (0, 30, 300, 3000, 30000)
OTHERS = ("radii", "thermal")


def measure_stable(sizes: str, seed: int) -> list[dict[str, Any]]:
    """Measure packings of one random start, quenched and made by each of the other ways."""
    start = pack(N, phi=START, seed=seed, sizes=sizes)
    made: dict[str, Packing] = {"0": start}
    made |= {str(sweeps): swap_sizes(start, sweeps=sweeps, seed=seed).packing for sweeps in SWEEPS[1:]}
    made |= {"radii": relax_radii(start), "thermal": anneal(start, seed=seed).packing}
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
    """Draw onset, energy, G and rattlers against the number of sweeps, and those of the other ways beside them."""
    rows = tables.read("ultrastable")
    out, axes = drawing("ultrastable", 2, 2, 4.6, 3.6)
    columns = {"phi_J": r"$\phi_J$", "energy": "energy a disk [k d²]", "g": "$G$ [k]", "rattlers": "rattlers"}
    for panel, (column, title) in zip(axes, columns.items(), strict=True):
        for k, (sizes, name) in enumerate(SIZES.items()):
            of_sizes = rows[rows["sizes"] == sizes]
            made = [of_sizes.loc[of_sizes["way"] == str(way), column].to_numpy() for way in (*SWEEPS[1:], *OTHERS)]
            mean = mean_over_packings(made)
            swaps = len(SWEEPS) - 1
            out.curve(panel, name, SWEEPS[1:], mean[:swaps], **style(k))
        label(panel, "sweeps", title, loc="best")
    out.caption = caption(out.name)
    return out


STUDY = Study(
    "ultrastable",
    "Ultrastable packings: onset, energy and moduli against how long sizes are swapped",
    {f"{sizes} {seed}": partial(measure_stable, sizes, seed) for seed in range(1, SEEDS + 1) for sizes in SIZES},
    draw_stable,
)
