"""A study of local strain in quasi-static shear of disks: how far it correlates, and how particles move.

Correlations go as cos(4 theta)/r^alpha. In reciprocal space, where a periodic box changes nothing, the cos(4 theta)
part of the spectrum of the shear strain goes as q^(alpha - 2) at small q.
"""

from collections.abc import Iterable
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.motion.local_strain import LocalStrain, local_strain
from jamlab.motion.mean_square_displacement import mean_square_displacement
from jamlab.packing.packing import Packing
from jamlab.plotting import in_unit
from jamlab.protocols.target_pressure import pack
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, mean_over_packings, of_packings
from studies.panels import Drawing, drawing, label, scale, style, write_interval
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

PRESSURE = 5e-2
ELASTIC, FLOWING = (4096, 40), (1024, 20)  # particles, packings
TINY = 1e-5  # strain of the elastic response
START, STRAIN, STEP, WINDOW = 0.15, 0.35, 5e-3, 1e-2
SHELLS = (0.5, 1.5, 2.5, 3.5, 5.0, 7.0, 10.0, 14.0)  # of |q| over 2 pi over the side of the box
# largest q that exponents are fitted to, 1/d: beyond, both spectra fall alike, since strains are means over neighbours
MOST = 0.7
PUBLISHED = {"elastic": 2.0, "flowing": 1.0, "displacement": 1.0}


def spectrum(found: LocalStrain) -> tuple[Array, Array]:
    """q of the shells, and the cos(4 theta) part of |strain_xy(q)|^2 in each, over its mean over all q."""
    strain = 0.5 * (found.strain[:, 0, 1] + found.strain[:, 1, 0])
    known = np.isfinite(strain)
    field, x, box = strain[known] - strain[known].mean(), found.packing.centroids[known], found.packing.box
    most = int(SHELLS[-1])
    whole = np.array([(a, b) for a in range(most + 1) for b in range(-most, most + 1) if a > 0 or b > 0])
    q = 2 * np.pi * whole @ np.linalg.inv(box).T
    power = np.abs(np.exp(-1j * q @ x.T) @ field) ** 2 / (field**2).sum()
    size, angle = np.hypot(*q.T), np.arctan2(q[:, 1], q[:, 0])
    shell = np.digitize(size / (2 * np.pi / np.sqrt(found.packing.area)), SHELLS)
    rows = []
    for k in range(1, len(SHELLS)):
        within = shell == k
        columns = np.column_stack([np.ones(within.sum()), np.cos(4 * angle[within])])
        rows.append((size[within].mean(), np.linalg.lstsq(columns, power[within], rcond=None)[0][1]))
    of_shells = np.array(rows)
    return of_shells[:, 0], of_shells[:, 1]


def _rows(case: str, seed: int, places: Iterable[float], values: Iterable[float]) -> list[dict[str, Any]]:
    pairs = enumerate(zip(places, values, strict=True))
    return [{"case": case, "seed": seed, "place": k, "x": x, "y": y} for k, (x, y) in pairs]


def measure_elastic(seed: int) -> list[dict[str, Any]]:
    """Measure the spectrum of a response so small that it is elastic."""
    start = pack(ELASTIC[0], PRESSURE, seed)
    run = quasistatic_shear(start, TINY, TINY)
    return _rows("elastic", seed, *spectrum(local_strain(run.frames[0], run.packing)))


def measure_flow(seed: int) -> list[dict[str, Any]]:
    """Measure spectra of strains in windows of quasi-static flow, and the mean square displacement."""
    run = quasistatic_shear(pack(FLOWING[0], PRESSURE, seed), STRAIN, STEP, snapshot_every=WINDOW)
    states: list[Packing] = [p for p in run.frames if p.provenance["flow_strain"] > START - 0.1 * WINDOW]
    found = [spectrum(local_strain(*pair)) for pair in pairwise(states)]
    rows = _rows("flowing", seed, *np.mean(found, axis=0))
    moved = mean_square_displacement(states)
    return rows + _rows("displacement", seed, moved.strain, moved.total)


def _tasks() -> dict[str, Task]:
    tasks: dict[str, Task] = {f"flow {seed}": partial(measure_flow, seed) for seed in range(1, FLOWING[1] + 1)}
    return tasks | {f"elastic {seed}": partial(measure_elastic, seed) for seed in range(1, ELASTIC[1] + 1)}


def exponent(x: Array, offset: float, groups: list[Array]) -> Array:
    """Slope of the mean over packings (packings, m) in logarithms, plus an offset."""
    return np.asarray(offset + np.polyfit(np.log(x), np.log(np.mean(groups[0], axis=0)), 1)[0])


def draw_strain_correlations(tables: EnsembleTables) -> Drawing:
    """Draw spectra of the elastic response and of flow, and the mean square displacement, beside published slopes."""
    rows = tables.read("strain-correlations")
    out, axes = drawing("strain-correlations", 1, 2, 4.6, 3.8)
    scale(*axes)
    for k, (case, published) in enumerate(PUBLISHED.items()):
        moved = case == "displacement"
        part, offset = axes[1 if moved else 0], 0.0 if moved else 2.0
        of_case = rows[rows["case"] == case]
        values = of_packings(of_case, "place", "y")[1]
        x = of_packings(of_case, "place", "x")[1].mean(axis=0)
        fitted = np.full(len(x), True) if moved else x < MOST
        found = bootstrap([values[:, fitted]], partial(exponent, x[fitted], offset))
        out.values[f"exponent, {case}"] = found
        name = "exponent" if moved else rf"{case}: $\alpha$"
        out.curve(
            part, f"{name} {write_interval(found)}", x, mean_over_packings(list(values.T)), band=False, **style(k)
        )
        line = values.mean(axis=0)[fitted][0] * (x[fitted] / x[fitted][0]) ** (published - offset)
        look = {"linestyle": "--", "color": style(k)["color"], "linewidth": 1.0}
        out.curve(part, f"published: {published:g}", x[fitted], line, **look)
    height = r"$\cos 4\theta$ part of $|\epsilon_{xy}(q)|^2$, over its mean"
    label(axes[0], in_unit("wave number $q$", "1/d"), height, loc="lower left")
    label(axes[1], r"strain $\Delta\gamma$", in_unit(r"$\langle\Delta r^2\rangle$", "d²"), loc="best")
    out.caption = caption(
        out.name, elastic=ELASTIC[0], flowing=FLOWING[0], many=ELASTIC[1], made=FLOWING[1], p=PRESSURE, tiny=TINY,
        window=WINDOW, start=START, strain=STRAIN, step=STEP, most=MOST,
    )  # fmt: skip
    return out


STUDY = Study(
    "strain-correlations", "Correlations of local strain and displacements in flow", _tasks(), draw_strain_correlations
)
