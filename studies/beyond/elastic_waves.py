"""Spectra and correlation lengths of non-affine displacements of disks, measured packing by packing."""

from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.mechanics.elasticity import linear_response
from jamlab.packing.packing import Packing
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.damping import StokesDrag
from jamlab.rheology.displacement_correlation import correlation_along_x, displacements_per_strain
from jamlab.rheology.displacement_spectrum import power_of, slow_displacements
from jamlab.structure.structure_factor import Waves, waves_of
from studies.tables import Task

K_MAX = 6.0  # 1/d
# edges of shells of |k|, over 2 pi over the root of the area of the box
# the first has waves along the sides of the box alone, the second those along its diagonals
SHELLS = np.array([0.5, 1.2, 1.7, 2.5, 3.5, 5, 7, 10, 14, 20, 28, 40, 56, 80, 113, 160, 226])
SLOW = {256: 40, 1024: 20, 2048: 20, 8192: 8, 32768: 3}  # N -> packings of slow shear
BOTH = {8192: 3, 32768: 3}  # and at frequencies
PRESSURES = (1e-2, 1e-3, 1e-4, 1e-5)
FREQUENCIES = tuple(10.0 ** (k / 2 - 4) for k in range(9))  # over p^(1/2)


def measure_packing(n: int, pressure: float, seed: int, frequencies: bool) -> list[dict[str, Any]]:
    """Measure the field of one packing with and without pre-stress, in slow shear and perhaps at frequencies."""
    packing = pack(n, pressure, seed, ensemble="shear-stabilized")
    who = {"n": n, "pressure": pressure, "seed": seed}
    rows = []
    for prestress in (False, True):
        rows += measure_slow(packing, prestress, {**who, "prestress": int(prestress), "omega": 0.0})
    omegas = [x * pressure**0.5 for x in FREQUENCIES] if frequencies else []
    for prestress in (False,) if n == max(BOTH) else (False, True):
        found = displacements_per_strain(packing, omegas, StokesDrag(), prestress) if omegas else ()
        for omega, (backbone, u, modulus) in zip(omegas, found, strict=True):
            row = {**who, "prestress": int(prestress), "omega": omega, "storage": modulus.real, "loss": modulus.imag}
            rows += _rows(packing, backbone, u, (u / modulus)[:, 1].real, row)
    return rows


def measure_slow(packing: Packing, prestress: bool, who: dict[str, Any]) -> list[dict[str, Any]]:
    """Measure the field in slow shear; a row without numbers if the packing is not stable."""
    try:
        backbone, u = slow_displacements(packing, prestress)
    except ConvergenceError:
        return [who]
    modulus = linear_response(packing, prestress=prestress).relaxed[0, 1, 0, 1]
    u = u - u.mean(axis=0)
    return _rows(packing, backbone, u, u[:, 1], {**who, "storage": modulus})


def _rows(packing: Packing, backbone: Packing, u: Any, u_y: Array, row: dict[str, Any]) -> list[dict[str, Any]]:
    """One row of the whole field, with the zero of the correlation of u_y and the mean of |u|^2 over the backbone
    (square), and one of each shell: its mean powers."""
    try:
        length = correlation_along_x(backbone.positions, u_y, packing.box).length
    except ConvergenceError:
        length = np.nan
    whole = {"area": packing.area, "box": packing.box[0, 0], "backbone": backbone.n, "length": length}
    who = {name: row[name] for name in ("n", "pressure", "seed", "prestress", "omega")}
    square = float((np.abs(u) ** 2).sum(axis=1).mean())
    waves = waves_of(packing, K_MAX)
    return [{**row, **whole, "square": square}, *({**who, **shell} for shell in _shells(packing, backbone, u, waves))]


def _shells(packing: Packing, backbone: Packing, u: Any, waves: Waves) -> Iterable[dict[str, Any]]:
    power = power_of(waves, backbone.positions, u)
    k = np.hypot(*waves.k.T)
    shell = np.digitize(k * np.sqrt(packing.area) / (2 * np.pi), SHELLS)
    for number in range(1, len(SHELLS)):
        if (within := shell == number).any():
            yield {
                "shell": number,
                "k": k[within].mean(),
                "waves": int(within.sum()),
                "transverse": power.transverse[within].mean(),
                "longitudinal": power.longitudinal[within].mean(),
            }


def tasks() -> dict[str, Task]:
    """Tasks of all packings, the small ones first."""
    found: dict[str, Task] = {}
    for n, made in SLOW.items():
        for p in PRESSURES if n > min(SLOW) else PRESSURES[:-1]:
            for seed in range(1, made + 1):
                both = seed <= BOTH.get(n, 0)
                name = f"{'both' if both else 'quasi'} {n} {p:g} {seed}"
                found[name] = partial(measure_packing, n, p, seed, both)
    return found


def whole_fields(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of whole fields. Columns added: density: of the backbone; ratio: the zero of the correlation over the box;
    viscosity: n <u^2>, which is eta_0 - eta_F of Stokes drag."""
    whole = rows[rows["area"].notna()]
    density = whole["backbone"] / whole["area"]
    return whole.assign(density=density, ratio=whole["length"] / whole["box"], viscosity=density * whole["square"])


def shells_of(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of shells. Columns added: across, along: n k^2 S p^(1/2) of the transverse and the longitudinal power."""
    who = ["n", "pressure", "seed", "prestress", "omega"]
    shells = rows[rows["shell"].notna()].drop(columns=["area", "backbone"])
    shells = shells.merge(whole_fields(rows)[[*who, "density"]], on=who)
    height = shells["density"] * shells["k"] ** 2 * shells["pressure"] ** 0.5
    return shells.assign(across=height * shells["transverse"], along=height * shells["longitudinal"])
