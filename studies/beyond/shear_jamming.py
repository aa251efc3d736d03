"""A study of shear jamming: the share of disk packings that are jammed when they are quenched, when they are sheared
until they jam, and under steady quasi-static shear."""

from functools import partial
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.flow.quasistatic_run import QuasistaticShear
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.geometry.contact_network import contacts
from jamlab.protocols.target_pressure import pack
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, mean_over_packings
from studies.panels import Drawing, drawing, label, scale, style
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

PARTICLES, SEEDS, STEP = 32, 20, 0.02
FRACTIONS = (0.82, 0.83, 0.84, 0.85)
STRAIN, STEADY = 0.4, 0.4
# Vagberg, Olsson & Teitel, Phys. Rev. E 83, 031307 (2011), N to infinity, to three digits
PUBLISHED = {"quenched": 0.842, "steady shear": 0.843}


def measure_jamming(phi: float, seed: int) -> list[dict[str, Any]]:
    """Quench one random start, shear it until it jams, and on."""
    packing = pack(PARTICLES, phi=phi, seed=seed)
    row: dict[str, Any] = {"phi": phi, "seed": seed, "quenched": float(not contacts(packing).unjammed), "strain": 0.0}
    if not row["quenched"]:
        run = quasistatic_shear(packing, STRAIN, STEP, until_jammed=True)
        found, packing = run.jamming, run.packing
        row["strain"] = np.nan if found is None else found.strain
        row["width"] = np.nan if found is None else found.strain - found.strain_below
    run = quasistatic_shear(packing, STRAIN + STEADY, STEP)
    row["steady"] = float(_jammed(run)[run.strain > STRAIN].mean())
    return [row | {"missed": int((~run.converged).sum())}]


def _jammed(run: QuasistaticShear) -> Array:
    return np.asarray(run.pressure > run.stress_noise, dtype=np.float64)


def _tasks() -> dict[str, Task]:
    pairs = [(phi, seed) for seed in range(1, SEEDS + 1) for phi in FRACTIONS]
    return {f"{phi:g} {seed}": partial(measure_jamming, phi, seed) for phi, seed in pairs}


def _half(groups: list[Array]) -> float:
    """Packing fraction at which half are jammed; nan if it is not crossed."""
    share = np.array([group.mean() for group in groups])
    above = np.flatnonzero(share >= 0.5)
    if not len(above) or above[0] == 0:
        return float("nan")
    k = int(above[0])
    return float(np.interp(0.5, share[k - 1 : k + 1], FRACTIONS[k - 1 : k + 1]))


def draw_jamming(tables: EnsembleTables) -> Drawing:
    """Draw the share of jammed packings over the packing fraction, and the strain at which they jam."""
    rows = tables.read("shear-jamming")
    rows = rows.assign(sheared=rows["strain"].notna().astype(float))
    out, axes = drawing("shear-jamming", 1, 2, 4.6, 3.8)
    scale(*axes, x="linear", y="linear")
    kinds = {
        "quenched": "quenched",
        "sheared": f"sheared until jammed, at most by {STRAIN:g}",
        "steady": "steady shear",
    }
    for k, (column, name) in enumerate(kinds.items()):
        groups = [rows.loc[rows["phi"] == phi, column].to_numpy(dtype=float) for phi in FRACTIONS]
        out.curve(axes[0], name, FRACTIONS, mean_over_packings(groups), band=False, **style(k))
        out.values[f"phi of a share of 1/2, {name}"] = bootstrap(groups, _half)
    for k, (name, phi) in enumerate(PUBLISHED.items()):
        axes[0].axvline(
            phi, color=style(2 * k)["color"], linestyle="--", linewidth=0.9, label=f"{name}, Vågberg et al."
        )
    loose = rows[(rows["quenched"] == 0) & rows["strain"].notna()]
    kept = [phi for phi in FRACTIONS if (loose["phi"] == phi).sum() >= 5]
    found = mean_over_packings([loose.loc[loose["phi"] == phi, "strain"].to_numpy() for phi in kept])
    out.curve(axes[1], "of packings that jam", kept, found, band=False, **style(1))
    label(axes[0], r"packing fraction $\phi$", "share of jammed packings", legend=False)
    out.legend_above(axes[0], ncols=3)
    label(axes[1], r"packing fraction $\phi$", r"strain $\gamma_J$ at which they jam", legend=False)
    numbers = {"n": PARTICLES, "made": rows.groupby("phi")["seed"].nunique().min(), "step": STEP, "most": STRAIN}
    out.caption = caption(out.name, **numbers, width=float(loose["width"].max()), missed=int(rows["missed"].max()))
    return out


STUDY = Study("shear-jamming", "Shear jamming: packings that shear jams, beside quenched ones", _tasks(), draw_jamming)
