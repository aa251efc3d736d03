"""The same disks with a small mass, in native LAMMPS: pair_style gran/hooke, fix nve/sphere disc, fix deform."""

import time
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.installation import lammps_class
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.packing.packing import Packing

STEP = 0.02  # over the mass, in units of tau_1: 0.1 diverges


def start_up(packing: Packing, rate: float, strains: Array, mass: float, beta: float = 1.0) -> tuple[Array, float]:
    """(m,) shear stress at strains (m,), and seconds of CPU; units "k" with k = tau = 1. Drag per velocity is k tau =
    meff gamma with meff = mass/2, and the friction limit is out of reach."""
    lmp = lammps_class()(cmdargs=["-screen", "none", "-log", "none", "-nocite"])
    assert packing.diameters is not None
    sizes, kinds = np.unique(packing.diameters, return_inverse=True)
    (lx, _), (xy, ly) = packing.box
    gamma = 2.0 / mass
    dt = STEP * mass
    lines = [
        *["units lj", "dimension 2", "newton off", "atom_style sphere", "atom_modify map array", "comm_modify vel yes"],
        f"region cell prism 0 {lx:.17g} 0 {ly:.17g} -0.5 0.5 {xy:.17g} 0 0",
        f"create_box {len(sizes)} cell",
    ]
    for line in lines:
        lmp.command(line)
    inside = packing.positions - np.floor(packing.positions @ np.linalg.inv(packing.box)) @ packing.box
    x = np.column_stack([inside, np.zeros(packing.n)])
    lmp.create_atoms(packing.n, list(range(1, packing.n + 1)), [int(k) + 1 for k in kinds], x.ravel().tolist())
    for k, size in enumerate(sizes):
        lmp.command(f"set type {k + 1} diameter {size:.17g} mass {mass:.17g}")
    for line in [
        f"pair_style gran/hooke 1.0 0.0 {gamma:.17g} {beta * gamma:.17g} 1e4 1",
        *["pair_coeff * *", "neighbor 0.1 bin", "neigh_modify every 1 delay 0 check yes"],
        *["fix move all nve/sphere disc", "fix flat all enforce2d", f"timestep {dt:.17g}"],
        f"velocity all ramp vx 0 {rate * ly:.17g} y 0 {ly:.17g}",
        f"fix lean all deform 1 xy erate {rate:.17g} remap v flip no",
        "thermo 1000000",
    ]:
        lmp.command(line)
    stresses, done, seconds = [], 0, 0.0
    for strain in strains:
        steps = round(strain / rate / dt)
        clock = time.process_time()
        lmp.command(f"run {steps - done} post no")
        seconds += time.process_time() - clock
        done = steps
        stresses.append(_stress(lmp, packing, rate, beta))
    lmp.close()
    return np.array(stresses), seconds


def _stress(lmp: Any, packing: Packing, rate: float, beta: float) -> float:
    """Stress over contacts, conjugate to the strain: T_x r_y with the tension T that acts on the first disk."""
    x, v, spin = (np.array(lmp.gather_atoms(name, 1, 3)).reshape(-1, 3) for name in ("x", "v", "omega"))
    _, _, xy, *_ = lmp.extract_box()
    box = np.array([packing.box[0], [xy, packing.box[1, 1]]])
    x, v, spin = x[:, :2], v[:, :2], spin[:, 2]
    beside = v - rate * np.column_stack([x[:, 1], np.zeros(packing.n)])
    assert packing.diameters is not None
    total = 0.0
    pairs = touching_disks(packing.with_state(positions=x, box=box))
    for i, j, r in zip(pairs.i, pairs.j, pairs.r, strict=True):
        distance, radii = np.hypot(*r), 0.5 * packing.diameters[[i, j]]
        normal = r / distance
        tangent = np.array([-normal[1], normal[0]])
        relative = beside[j] - beside[i] + [rate * r[1], 0.0]
        approach, slide = relative @ normal, relative @ tangent - radii @ spin[[i, j]]
        tension = (approach - (radii.sum() - distance)) * normal + beta * slide * tangent
        total += tension[0] * r[1]
    return total / packing.area
