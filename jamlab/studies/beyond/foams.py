"""Droplets where foam physics is exact: the hexagonal crystal, its dry limit, and one disordered foam of another code.

In a hexagonal crystal of droplets with area a, cells of area A_c have sides s = (2 A_c/3^1.5)^0.5. Rims of width delta = 2w
that do not yield leave each outline the hexagon of side s - 2w/3^0.5 with corners rounded to a radius r:
a = 1.5 3^0.5 (s - 2w/3^0.5)^2 - (2 3^0.5 - pi) r^2. The derivatives of its length, times line tension gamma, give the
osmotic pressure, gamma ((s - 2w/3^0.5)/(s r) - 2/(3^0.5 s)). Shear leaves three films at 120 degrees in each corner, the
Steiner tree of a triangle whose squared length is half the sum of its squared sides plus 2 3^0.5 times its area; with it
G = gamma (1 + w/r)/(3^0.5 s), and 0.525 gamma/R for thin rims and A_c = pi R^2: the dry foam of Princen, J. Colloid
Interface Sci. 91, 160 (1983), where gamma is half the tension of a film.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, elastic_tensor, modulus_along
from jamlab.mechanics.stiffness import stress
from jamlab.packing.free_droplet import free_area, regular_polygon
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.studies.panels import FIT, PAPER, drawing, label, scale, sequence, style
from jamlab.studies.study import Shown, TableStudy
from jamlab.studies.table import MeasuredTable, Row, Task

LAW = {"gamma": 0.01, "ka": 10.0, "eps": 1.0, "delta": 0.02, "eta": 0.0, "contact": "outline"}  # thin rims, hard to press
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
        yield row | {"pressure": float(0.5 * np.trace(stress(state)))}


@dataclass(frozen=True)
class Crystal(TableStudy):
    """The hexagonal crystal of droplets against the exact foam."""

    columns: ClassVar = ("vertices", "rho", "cell", "area", "length", "pressure", "g")
    task: ClassVar[str] = "crystal"
    kind: ClassVar[str] = "foam"

    def tasks(self) -> Mapping[str, Task]:
        """One number of vertices each."""
        return {f"{vertices}": partial(measure_crystal, vertices) for vertices in VERTICES}

    def show(self, table: MeasuredTable) -> Shown:
        """Draw pressure and G over rho beside the exact ones, and how errors fall with the number of vertices."""
        rows = table.rows
        out, (pressure, modulus, errors) = drawing(self.name, 1, 3, 4.5, 3.8)
        scale(errors)
        radius = np.sqrt(rows["cell"] / np.pi) / LAW["gamma"]  # stresses times R over gamma
        exact = dict(zip(("length", "pressure", "g"), rounded_hexagons(rows["cell"], rows["area"]), strict=True))
        missed = {}
        for k, (vertices, part) in enumerate(rows.groupby("vertices")):
            at = part.index
            for axes, name in ((pressure, "pressure"), (modulus, "g")):
                look = {**sequence(k, len(VERTICES)), "linestyle": "none"}
                out.curve(axes, f"{vertices} vertices", part["rho"], part[name] * radius[at], **look)
            near = (part["rho"] - COMPARED).abs().idxmin()
            missed[vertices] = [abs(float(part.at[near, name] / exact[name][near] - 1)) for name in exact]
        for axes, name in ((pressure, "pressure"), (modulus, "g")):
            out.curve(axes, "exact", part["rho"], exact[name][at] * radius[at], **FIT)
            axes.set_ylim(0, 1.1 * float((rows[name] * radius).max()))
        out.curve(modulus, "dry foam", DENSITIES[:2], [DRY, DRY], **PAPER)
        for k, name in enumerate(("length of outlines", "pressure", "G")):
            found = out.keep(f"relative error of {name}", [each[k] for each in missed.values()], vertices=missed)
            out.curve(errors, name, list(missed), found, **style(k))
        rho = r"true packing fraction $\rho$"
        label(pressure, rho, r"osmotic pressure  [$\gamma/R$]", loc="upper left")
        label(modulus, rho, r"$G$  [$\gamma/R$]", loc="lower right")
        label(errors, "vertices of a droplet", rf"relative error at $\rho$ = {COMPARED:g}", loc="best")
        last = max(missed)
        worst = ", ".join(f"{name} {found:.1e}" for name, found in zip(exact, missed[last], strict=True))
        out.caption = (
            f"Hexagonal crystal of droplets with thin rims (width {LAW['delta']:g} of the root of their area) beside "
            f"the exact foam: hexagons with rounded corners, which in shear keep films at 120 degrees. (b) Dashed: dry "
            f"foam without rims, G = {DRY:.3f} gamma/R, gamma being half the tension of a film. (c) What facets leave "
            f"out; with {last} vertices, relative errors are: {worst}. {table.made}."
        )
        return Shown(out.figure, out.caption, rows=out.table, numbers=out.numbers)


CRYSTAL = Crystal("beyond-droplet-crystal", "Hexagonal crystal of droplets beside the exact foam")
