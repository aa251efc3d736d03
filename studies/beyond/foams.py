"""Droplets where foam physics is exact: the hexagonal crystal, its dry limit, and disordered foams of another code.

In a hexagonal crystal of droplets with area a, cells of area A_c have sides s = (2 A_c/3^1.5)^0.5. Rims of width 2w
that do not yield leave each outline the hexagon of side s - 2w/3^0.5 with corners rounded to a radius r:
a = 1.5 3^0.5 (s - 2w/3^0.5)^2 - (2 3^0.5 - pi) r^2. The derivatives of its length, times line tension gamma, give the
osmotic pressure, gamma ((s - 2w/3^0.5)/(s r) - 2/(3^0.5 s)). Sheared films keep 120 degrees: they are the Steiner tree
of a triangle, whose squared length is half the sum of squared sides plus 2 3^0.5 times its area. With it G is
gamma (1 + w/r)/(3^0.5 s), for thin rims and A_c = pi R^2 0.525 gamma/R, half of what 0.525 tensions of a film would be.
"""

import subprocess
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, elastic_tensor, modulus_along
from jamlab.mechanics.stiffness import pressure
from jamlab.models.droplets import free_area, regular_polygon
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from studies.ensemble_tables import EnsembleTables
from studies.panels import FIT, PAPER, Drawing, drawing, label, scale, sequence, style
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Row

LAW: dict[str, Any] = {
    "gamma": 0.01,
    "ka": 10.0,
    "eps": 1.0,
    "delta": 0.02,
    "eta": 0.0,
    "contact": "outline",
}  # thin rims, hard to press
VERTICES = (18, 24, 36, 48, 72)
DENSITIES = (0.905, 0.985, 0.016)  # first, last, step of rho
COMPARED = 0.953  # rho at which errors are drawn over the number of vertices
DRY = (3**0.5 / (2 * np.pi)) ** 0.5  # G R/gamma of the dry foam, 0.525


def crystal(vertices: int, rho: float) -> Packing:
    """Four droplets of area 1 on a hexagonal lattice, as regular polygons that do not touch below 0.907."""
    law = LAW | {"a0": np.ones(4)}
    spacing = np.sqrt(2 / np.sqrt(3) * free_area([vertices], law | {"a0": np.ones(1)})[0] / rho)
    lattice = spacing * np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
    centres = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) @ lattice
    ring = regular_polygon(vertices, 1.0, np.pi / 6)
    box = np.diag([2 * spacing, np.sqrt(3) * spacing])
    return Packing("dp", box, (centres[:, None] + ring).reshape(-1, 2), law, offsets=vertices * np.arange(5))


def rounded_hexagons(cell: Array, area: Array) -> tuple[Array, Array, Array]:
    """Length of the outline, osmotic pressure and G of droplets (m,) in cells of the crystal, see above."""
    w, side = 0.5 * LAW["delta"], np.sqrt(2 * cell / 3**1.5)
    inner = side - 2 * w / 3**0.5
    r = np.sqrt((1.5 * 3**0.5 * inner**2 - area) / (2 * 3**0.5 - np.pi))
    length = 6 * inner - (4 * 3**0.5 - 2 * np.pi) * r
    pressure = LAW["gamma"] * (inner / (side * r) - 2 / (3**0.5 * side))
    return length, pressure, LAW["gamma"] * (1 + w / r) / (3**0.5 * side)


def measure_crystal(vertices: int) -> Iterator[Row]:
    """Compress a crystal of droplets, and measure what is known exactly."""
    first, last, step = DENSITIES
    for state in compress(crystal(vertices, first), last, step):
        g = float(modulus_along(elastic_tensor(state).relaxed, AVERAGING_ANGLES).mean())
        row = {"vertices": vertices, "rho": packing_fraction(state), "cell": state.area / state.n, "g": g}
        row |= {"area": float(state.polygon_areas.mean()), "length": float(state.perimeters.mean())}
        yield row | {"pressure": pressure(state)}


def draw_crystal(tables: EnsembleTables) -> Drawing:
    """Draw pressure and G over rho beside the exact ones, and how errors fall with the number of vertices."""
    table = tables.read("beyond-droplet-crystal")
    columns = ("rho", "cell", "area", "length", "pressure", "g")
    rho, cell, area, *ours = (table[name].to_numpy(np.float64) for name in columns)
    out, (pressure, modulus, errors) = drawing("beyond-droplet-crystal", 1, 3, 4.5, 3.8)
    scale(errors)
    unit = np.sqrt(cell / np.pi) / LAW["gamma"]  # stresses times R over gamma
    exact = rounded_hexagons(cell, area)
    missed: dict[int, list[float]] = {}
    for k, vertices in enumerate(VERTICES):
        at = np.flatnonzero(table["vertices"] == vertices)
        for axes, values in ((pressure, ours[1]), (modulus, ours[2])):
            look = {**sequence(k, len(VERTICES)), "linestyle": "none"}
            out.curve(axes, f"{vertices} vertices", rho[at], (values * unit)[at], **look)
        near = at[np.abs(rho[at] - COMPARED).argmin()]
        missed[vertices] = [abs(float(o[near] / e[near] - 1)) for o, e in zip(ours, exact, strict=True)]
    for axes, values in ((pressure, exact[1]), (modulus, exact[2])):
        out.curve(axes, "exact", rho[at], (values * unit)[at], **FIT)
        axes.set_ylim(0, 1.1 * float((values * unit).max()))
    out.curve(modulus, "dry foam", DENSITIES[:2], [DRY, DRY], **PAPER)
    for k, name in enumerate(("length of outlines", "pressure", "G")):
        found = out.keep(f"relative error of {name}", [each[k] for each in missed.values()], vertices=missed)
        out.curve(errors, name, list(missed), found, **style(k))
    text = r"true packing fraction $\rho$"
    label(pressure, text, r"osmotic pressure  [$\gamma/R$]", loc="upper left")
    label(modulus, text, r"$G$  [$\gamma/R$]", loc="lower right")
    label(errors, "vertices of a droplet", rf"relative error at $\rho$ = {COMPARED:g}", loc="best")
    out.caption = caption(out.name, width=LAW["delta"], dry=DRY)
    return out


# a disordered foam, by Surface Evolver --------------------------------------------------------------------------------

FOAM: dict[str, Any] = {"gamma": 0.04, "ka": 30.0, "eps": 1.0, "delta": 0.1}  # rims that hardly yield
WET = 0.98  # rho: all voids are three-sided, so films continued into them meet in one point
STRAIN = 0.01
FINE = ((1, 24), (2, 24), (3, 24), (1, 48))  # seeds, and vertices of the small droplets


def dry_skeleton(packing: Packing) -> tuple[Array, dict[int, tuple[int, int, Array]], list[list[int]]]:
    """Continue the films of droplets with three-sided voids until they meet: (v, 2) places of the voids; of each
    contact the two voids at its ends, and the lattice vector between them; the contacts around every droplet, counted
    from 1, negative where the film is followed backwards."""
    network, inverse = contacts(packing), np.linalg.inv(packing.box)
    around: list[list[tuple[float, int, Array]]] = [[] for _ in range(packing.n)]
    for k, ((i, j), r) in enumerate(zip(network.pairs, network.r, strict=True)):
        around[i].append((float(np.arctan2(r[1], r[0])), k, r))
        around[j].append((float(np.arctan2(-r[1], -r[0])), k, -r))
    names: dict[tuple[int, ...], int] = {}
    films: dict[int, tuple[int, int, Array]] = {}
    places: list[Array] = []
    cells: list[list[int]] = []
    for centre, ring in zip(packing.centroids, around, strict=True):
        ring.sort(key=lambda each: each[0])
        corners = [centre + (r + ring[(m + 1) % len(ring)][2]) / 3 for m, (_, _, r) in enumerate(ring)]
        at = []
        for corner in corners:
            inside = (corner @ inverse) % 1.0
            name = tuple(np.round(inside * 1e5).astype(int) % 100000)
            if name not in names:
                names[name] = len(places)
                places.append(inside @ packing.box)
            at.append(names[name])
        cell = []
        for m, (_, k, _) in enumerate(ring):
            if k in films:
                cell.append(-k - 1)
                continue
            crossed = (corners[m] - corners[m - 1] - places[at[m]] + places[at[m - 1]]) @ inverse
            films[k] = at[m - 1], at[m], np.round(crossed).astype(int)
            cell.append(k + 1)
        cells.append(cell)
    return np.array(places), films, cells


def relax_by_evolver(packing: Packing, areas: Array, tension: Array) -> tuple[Array, Array, Array]:
    """Energies (3,) of the dry foam at shear -`STRAIN`, 0, `STRAIN`, pressures (n,) and lengths (n,) of its cells, by
    the program Surface Evolver. `areas`: (n,) of the cells; `tension`: (contacts,) of the films."""
    program = next(filter(None, map(which, ("evolver-nox-d", "evolver"))), None)
    if program is None:
        raise InputError("Surface Evolver is not installed: apt install evolver-nox")
    places, films, cells = dry_skeleton(packing)
    (width, _), (lean, height) = packing.box
    sign = {1: "+", 0: "*", -1: "-"}
    lines = ["STRING", "SPACE_DIMENSION 2", "PARAMETER strain = 0", "TORUS_FILLED", "PERIODS", f"{width:.17g} 0"]
    lines += [f"{lean:.17g} + strain*{height:.17g} {height:.17g}", "VERTICES"]
    lines += [f"{k} {x:.17g} {y:.17g}" for k, (x, y) in enumerate(places, 1)] + ["EDGES"]
    for k, (start, end, (a, b)) in films.items():
        lines.append(f"{k + 1} {start + 1} {end + 1} {sign[a]} {sign[b]} tension {tension[k]:.17g}")
    lines += ["FACES", *(f"{m} {' '.join(map(str, cell))}" for m, cell in enumerate(cells, 1)), "BODIES"]
    lines += [f"{m} {m} volume {area:.17g}" for m, area in enumerate(areas, 1)]
    lines += ["read", "U", "g 100; r; g 100; r; g 200; r; g 300; g 300"]
    for strain in (-STRAIN, STRAIN, 0.0):
        lines.append(f'strain := {strain:g}; recalc; g 500; printf "ENERGY {strain:g} %.17g\\n", total_energy')
    lines.append('foreach body bb do printf "PRESSURE %d %.17g\\n", bb.id, bb.pressure')
    lines.append('foreach facet ff do printf "LENGTH %d %.17g\\n", ff.id, sum(ff.edge, length)')
    with TemporaryDirectory() as folder:
        file = Path(folder, "foam.fe")
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        done = subprocess.run([program, file], input="q\nq\n", capture_output=True, text=True, check=True, timeout=600)
    found: dict[str, dict[float, float]] = {"ENERGY": {}, "PRESSURE": {}, "LENGTH": {}}
    for line in done.stdout.splitlines():
        word, _, rest = line.partition(" ")
        if word in found:
            key, value = map(float, rest.split())
            found[word][key] = value
    energy, pressure, length = (np.array([v for _, v in sorted(each.items())]) for each in found.values())
    return energy, pressure, length


def measure_foam(seed: int, vertices: int) -> Iterator[Row]:
    """Compare droplets with the dry foam that they decorate: films of tension 2 gamma + w (p_i + p_j), as a rim of
    half-width w adds w p to gamma, cells that hold a droplet, its rim and a third of every void beside it."""
    onset = jam("dp", 16, seed, nv_small=vertices, nv_large=round(17 / 12 * vertices), **FOAM)
    *_, state = compress(onset, WET, 0.01)
    pairs = contacts(state).pairs
    sides = np.bincount(pairs.ravel(), minlength=state.n)
    if not state.converged or sides.sum() != 6 * state.n:
        return
    w, gamma = 0.5 * state.params["delta"], state.params["gamma"]
    pressure = state.params["ka"] * (state.params["a0"] - state.polygon_areas)
    radius = gamma / pressure
    void = (3**0.5 - np.pi / 2) * (radius + w).mean() ** 2
    areas = state.polygon_areas + w * state.perimeters + np.pi * w**2 + sides / 3 * void
    who = {"seed": seed, "vertices": vertices}
    yield who | {"what": "area of all cells", "ours": float(areas.sum()), "theirs": state.area}
    tension = 2 * gamma + w * pressure[pairs].sum(axis=1)
    energy, theirs, length = relax_by_evolver(state, areas * state.area / areas.sum(), tension)
    g = float(modulus_along(elastic_tensor(state).relaxed, np.zeros(1))[0])
    yield who | {"what": "G", "ours": g, "theirs": float(energy @ [1, -2, 1]) / STRAIN**2 / state.area}
    corner = 2 * w / 3**0.5 - w * np.pi / 3 + (2 / 3**0.5 - np.pi / 3) * radius
    inner = length - 2 * np.pi * w - sides * corner  # along the outlines of droplets in these cells
    for m in range(state.n):
        yield who | {"what": "length", "ours": float(state.perimeters[m]), "theirs": float(inner[m])}
        one = {"ours": float(pressure[m] - pressure.mean()), "theirs": float(theirs[m] - theirs.mean())}
        yield who | {"what": "pressure"} | one


def draw_foam(tables: EnsembleTables) -> Drawing:
    """Draw lengths and pressures of droplets over those of the other code, and keep the largest differences."""
    rows = tables.read("beyond-droplet-foam")
    out, axes = drawing("beyond-droplet-foam", 1, 2, 4.5, 3.9)
    for part, (what, unit) in zip(axes, (("length", "[l]"), ("pressure", "[ε/l²]")), strict=True):
        of = rows[rows["what"] == what]
        for k, ((seed, vertices), one) in enumerate(of.groupby(["seed", "vertices"])):
            look = style(k) | {"linestyle": "none"}
            out.curve(part, f"start {seed}, {vertices} vertices", one["theirs"], one["ours"], **look)
        ends = np.array([of["theirs"].min(), of["theirs"].max()])
        out.curve(part, "equal", ends, ends, label=None, **FIT)
        name = what if what == "length" else "pressure less the mean"
        label(part, f"{name}, Surface Evolver  {unit}", f"{name}, droplets  {unit}", loc="upper left")
    for each, of in rows.groupby("what"):
        whole = of["theirs"].abs().max() if each == "pressure" else of["theirs"]
        out.keep(f"{each}, largest relative difference", ((of["ours"] - of["theirs"]) / whole).abs().max())
    out.caption = caption(out.name, made=rows["seed"].nunique(), wet=WET, width=FOAM["delta"])
    return out


STUDIES = (
    Study(
        "beyond-droplet-crystal",
        "Hexagonal crystal of droplets beside the exact foam",
        {f"{vertices}": partial(measure_crystal, vertices) for vertices in VERTICES},
        draw_crystal,
    ),
    Study(
        "beyond-droplet-foam",
        "Disordered droplets beside Surface Evolver",
        {f"{seed}, {vertices}": partial(measure_foam, seed, vertices) for seed, vertices in FINE},
        draw_foam,
    ),
)
