"""A study of droplets that adhere: the force that parts two of them, and the tension at which packings tear."""

from functools import partial
from typing import Any

import numpy as np
from scipy import integrate

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.laws.adhesive import AdhesiveLaw
from jamlab.mechanics.stiffness import pressure
from jamlab.models.droplets import regular_polygon
from jamlab.packing.packing import Packing
from jamlab.plotting import in_unit
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from jamlab.protocols.relax import relax
from jamlab.statistics.confidence import Interval
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import mean_over_packings, of_packings
from studies.panels import Drawing, drawing, label, scale, style
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

ADHESIONS, RANGE = (0.002, 0.005, 0.01, 0.02), 0.3
N, SEEDS, STEPS, STEP = 16, 20, 20, 0.01
DELTA, VERTICES = 0.25, 14
ROUNDING = 1e-3  # eta, l


def measure_adhesion(seed: int) -> list[dict[str, Any]]:
    """Measure one onset at every adhesion: two droplets pulled apart, and the packing expanded until it tears."""
    onset = jam(N, "dp", seed=seed, start="from-disks")
    rows = []
    for pull in ADHESIONS:
        known = {"seed": seed, "adhesion": pull, "two": pull_off(pull, np.random.default_rng(seed))}
        law = {**onset.params, "adhesion": pull, "adhesion_range": RANGE, "eta": ROUNDING}
        start = relax(onset.with_state(params=law))
        rows += [known | row for row in _expanded(start)]
    return rows


def _expanded(start: Packing) -> list[dict[str, Any]]:
    found = [_state(0.0, start)]
    try:
        for packing in compress(start, to=start.phi - STEP * STEPS, step=STEP, by="phi"):
            found.append(_state(start.phi - packing.phi, packing))
    except ConvergenceError as error:
        found.append({"below": STEP * len(found), "converged": False, "note": str(error)})
    return found


def _state(below: float, packing: Packing) -> dict[str, Any]:
    return {
        "below": round(below, 6),
        "converged": packing.converged,
        "pressure": pressure(packing),
        "z": contacts(packing).z,
        "phi": packing.phi,
    }


def pull_off(pull: float, random: np.random.Generator) -> float:
    """Largest pull between two regular polygons of area 1, turned at random, over their distance, eps/l."""
    radius = np.sqrt(2 / (VERTICES * np.sin(2 * np.pi / VERTICES)))
    law = {"gamma": 0.4, "ka": 300.0, "eps": 1.0, "delta": DELTA, "eta": 0.0, "contact": "outline", "a0": np.ones(2)}
    law |= {"adhesion": pull, "adhesion_range": RANGE}
    turns, largest = 2 * np.pi * random.random(2), 0.0
    for gap in DELTA * np.linspace(0.8, 1.3, 101):
        apart = np.array([2 * radius + gap, 0.0])
        rings = [regular_polygon(VERTICES, 1.0, turn) + k * apart for k, turn in enumerate(turns)]
        two = Packing("dp", 10 * np.eye(2), np.concatenate(rings), law, offsets=np.arange(3) * VERTICES)
        largest = max(largest, float(-contacts(two).forces.on_j[:, 0].sum()))
    return largest


def pull_of_circles(pull: float) -> float:
    """The same of circles of area 1, of as many vertices spread evenly, by quadrature."""
    law, radius = AdhesiveLaw("eps", 1.0, DELTA, pull, RANGE), np.sqrt(1 / np.pi)

    def along(angle: float, gap: float) -> float:
        ahead, across = 2 * radius + gap - radius * np.cos(angle), radius * np.sin(angle)
        distance = np.hypot(ahead, across) - radius
        if distance >= DELTA + law.range:
            return 0.0
        slope = law(np.array([DELTA]), np.array([distance]))[1]
        return float(slope[0] * ahead / (distance + radius))

    gaps = DELTA * np.linspace(0.9, 1.3, 81)
    return float(VERTICES / np.pi * max(integrate.quad(along, -1.2, 1.2, (gap,), limit=200)[0] for gap in gaps))


def rumpf(z: Array, phi: Array, force: Array) -> Array:
    """Tension at which all contacts of force F part at once, z phi F/(pi d) of disks of diameter d = 2/sqrt(pi): Rumpf,
    Chem. Ing. Tech. 42, 538 (1970), in two dimensions."""
    return np.asarray(z * phi * force / (np.pi * 2 / np.sqrt(np.pi)))


def draw_adhesion(tables: EnsembleTables) -> Drawing:
    """Draw the pull-off force of two droplets beside a quadrature, tension over expansion, and tensile strength."""
    rows = tables.read("adhesive-droplets")
    failed = int((~rows["converged"]).sum())
    kept = rows[rows["converged"]]
    out, axes = drawing("adhesive-droplets", 1, 3, 4.3, 3.6)
    for part in (axes[0], axes[2]):
        scale(part)
    pulls, values = of_packings(kept[kept["below"] == 0], "adhesion", "two")
    out.curve(axes[0], "two polygons", pulls, mean_over_packings([values])[0], band=False, **style(0))
    circles = np.array([pull_of_circles(pull) for pull in pulls])
    axes[0].plot(pulls, circles, color="black", linestyle="dashed", label="circles, by quadrature")
    for k, pull in enumerate(ADHESIONS):
        of_law = kept[kept["adhesion"] == pull]
        below, tension = of_packings(of_law, "below", "pressure")
        out.curve(axes[1], f"{pull:g}", below, mean_over_packings([-tension])[0], band=False, **style(k))
    torn = kept.groupby(["adhesion", "seed"]).agg(strength=("pressure", "min")).reset_index()
    torn["strength"] = -torn["strength"]
    start = (
        kept[kept["below"] == 0]
        .set_index(["adhesion", "seed"])
        .loc[list(zip(torn["adhesion"], torn["seed"], strict=True))]
    )
    torn["rumpf"] = rumpf(*(start[name].to_numpy() for name in ("z", "phi", "two")))
    torn["ratio"] = torn["strength"] / torn["rumpf"]
    for k, (name, text) in enumerate((("strength", "measured"), ("rumpf", "Rumpf"))):
        pulls, values = of_packings(torn, "adhesion", name)
        out.curve(axes[2], text, pulls, mean_over_packings([values])[0], band=False, **style(k))
    for name, table, column in (("pull-off over quadrature", kept[kept["below"] == 0], "two"), ("", torn, "ratio")):
        pulls, values = of_packings(table, "adhesion", column)
        if name:
            values = values / circles
        mean = mean_over_packings([values])[0]
        for k, pull in enumerate(pulls):
            one = Interval(mean.value[k], mean.low[k], mean.high[k])
            out.values[f"{name or 'tensile strength over that of Rumpf'}, adhesion {pull:g}"] = one
    label(axes[0], in_unit("adhesion", "ε/δ"), in_unit("pull-off force", "ε/l"), loc="best")
    axes[1].set_xticks(np.arange(0.0, STEP * STEPS + 0.01, 0.05))
    label(axes[1], r"distance from onset $\phi_J - \phi$", in_unit("tension", "ε/l²"), loc="best", title="adhesion")
    label(axes[2], in_unit("adhesion", "ε/δ"), in_unit("tensile strength", "ε/l²"), loc="best")
    out.caption = caption(out.name, n=N, made=SEEDS, range=RANGE, failed=failed, rows=len(rows))
    return out


def _tasks() -> dict[str, Task]:
    return {f"{seed}": partial(measure_adhesion, seed) for seed in range(1, SEEDS + 1)}


STUDY = Study("adhesive-droplets", "Droplets that adhere: pull-off and tensile strength", _tasks(), draw_adhesion)
