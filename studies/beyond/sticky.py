"""A study of sticky disks: where they become rigid, and how G, B and z grow from there, for several stickinesses."""

from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import curve_fit

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.rigid_clusters import rigid_clusters
from jamlab.mechanics.stiffness import pressure
from jamlab.plotting import in_unit
from jamlab.protocols.moduli import bulk_modulus, shear_modulus
from jamlab.protocols.target_pressure import pack
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, mean_over_packings, of_packings
from studies.panels import Drawing, drawing, label, scale, style, write_interval
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

FRACTIONS = {
    0.01: (0.74, 0.75, 0.76, 0.77, 0.78, 0.79, 0.8, 0.81, 0.82, 0.83, 0.84, 0.86, 0.88, 0.9),
    0.03: (0.66, 0.675, 0.69, 0.705, 0.72, 0.735, 0.75, 0.765, 0.78, 0.795, 0.8, 0.83, 0.86, 0.89),
    0.1: (0.52, 0.54, 0.56, 0.58, 0.6, 0.62, 0.64, 0.66, 0.68, 0.7, 0.74, 0.78, 0.82, 0.86),
}
SIZES, SEEDS = (128, 512), 20
FITTED = {"g": (0.004, 0.12), "b": (0.004, 0.3)}  # means that a power of phi - phi_c is fitted to, k


def measure_sticky(n: int, stickiness: float, seed: int) -> list[dict[str, Any]]:
    """Measure one random start at every packing fraction; nan where a packing is no minimum."""
    return [
        {"n": n, "stickiness": stickiness, "phi": phi, "seed": seed, **_measure(n, stickiness, phi, seed)}
        for phi in FRACTIONS[stickiness]
    ]


def _measure(n: int, stickiness: float, phi: float, seed: int) -> dict[str, Any]:
    packing = pack(n, phi=phi, seed=seed, law={"stickiness": stickiness})
    found = {"converged": packing.converged, "z": contacts(packing).z, "pressure": pressure(packing)}
    found["cluster"] = int(rigid_clusters(packing).sizes[0]) / n
    try:
        return found | {"g": shear_modulus(packing), "b": bulk_modulus(packing)}
    except ConvergenceError as error:
        return found | {"note": str(error)}


def _tasks() -> dict[str, Task]:
    named = [(n, a, seed) for n in SIZES for a in FRACTIONS for seed in range(1, SEEDS + 1)]
    return {f"{n} {a:g} {seed}": partial(measure_sticky, n, a, seed) for n, a, seed in named}


def onset_and_exponent(phi: Array, column: str, groups: list[Array]) -> Array:
    """phi_c and f of column = A (phi - phi_c)^f, fitted to means over packings (packings, m) in a range of `FITTED`."""
    mean, error = np.nanmean(groups[0], axis=0), np.nanstd(groups[0], axis=0)
    low, high = FITTED[column]
    kept = (mean > low) & (mean < high)
    phi, mean, error = phi[kept], mean[kept], error[kept]

    def law(x: Array, amplitude: float, onset: float, exponent: float) -> Array:
        return np.asarray(amplitude + exponent * np.log(x - onset))

    bounds = [-9.0, 0.0, 0.1], [9.0, phi[0] - 1e-4, 8.0]
    found, _ = curve_fit(law, phi, np.log(mean), (0.0, phi[0] - 0.03, 1.2), error / mean, bounds=bounds, max_nfev=9999)
    return np.asarray(found[1:])


def draw_sticky(tables: EnsembleTables) -> Drawing:
    """Draw z, p and the largest rigid cluster over phi, and z, G and B over the distance from where moduli vanish."""
    rows = tables.read("sticky")
    rows = rows[rows["converged"]]
    out, axes = drawing("sticky", 2, 3, 4.3, 3.6)
    scale(axes[3], y="linear")
    scale(*axes[4:])
    for k, a in enumerate(FRACTIONS):
        of_law = rows[(rows["stickiness"] == a) & (rows["n"] == max(SIZES))]
        for column in FITTED:
            phi, values = of_packings(of_law, "phi", column)
            found = bootstrap([values], partial(onset_and_exponent, phi, column))
            for index, name in enumerate(("phi_c", "exponent")):
                out.values[f"{name} of {column.upper()}, a = {a:g}"] = found[index]
        for part, column in zip(axes, ("z", "pressure", "cluster", "z", "g", "b"), strict=True):
            phi, values = of_packings(of_law, "phi", column)
            text, onset, fitted = f"a = {a:g}", 0.0, column.upper() if column in FITTED else "G"
            if part in axes[3:]:
                onset = float(out.values[f"phi_c of {fitted}, a = {a:g}"].value)
            if column in FITTED:
                text += f": {write_interval(out.values[f'exponent of {fitted}, a = {a:g}'])}"
            beyond = phi > onset
            mean = mean_over_packings([values[:, beyond]])[0]
            out.curve(part, text, phi[beyond] - onset, mean, band=False, **style(k))
    titles = (
        "coordination number $z$",
        in_unit("pressure $p$", "k"),
        "largest rigid cluster over $N$",
        "coordination number $z$",
        in_unit("shear modulus $G$", "k"),
        in_unit("bulk modulus $B$", "k"),
    )
    for k, (part, title) in enumerate(zip(axes, titles, strict=True)):
        if k > 3:
            part.set_ylim(top=20 * part.get_ylim()[1])  # room for the legend
        label(
            part,
            r"nominal packing fraction $\phi$" if k < 3 else r"distance from onset $\phi - \phi_c$",
            title,
            loc="best" if k < 4 else "upper left",
        )
    counts = rows.groupby(["n", "stickiness", "phi"]).size()
    out.caption = caption(out.name, n=max(SIZES), few=counts.min(), most=counts.max())
    return out


STUDY = Study("sticky", "Sticky disks: rigidity, moduli and contacts against stickiness", _tasks(), draw_sticky)
