"""Disks in ASE with matscipy's calculator, their elasticity by matscipy, and their contacts and order by freud."""

from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.packing.packing import Packing
from jamlab.processes.side_by_side import run_side_by_side
from studies.other_codes.peers import Analyst, Descent, Peer, Point, mean_diameters

HEIGHT = 20.0  # mean diameters: its box is three-dimensional, forces stay in the plane


def elasticity_by_matscipy(packing: Packing) -> dict[str, Any]:
    """Energy, pressure and shear modulus along x of a backbone: rattlers leave its Hessian singular."""
    atoms = disks_in_ase(packing)
    born = atoms.calc.get_property("born_constants", atoms)
    relaxation = atoms.calc.get_property("nonaffine_elastic_contribution", atoms)
    # Born's constants are of symmetric strain; simple shear x -> x + gamma y has a term of the stress as well
    stress = -HEIGHT * atoms.get_stress(voigt=False)
    return {
        "energy": float(atoms.get_potential_energy()),
        "pressure": 0.5 * (stress[0, 0] + stress[1, 1]),
        "shear modulus": HEIGHT * (born[0, 1, 0, 1] + relaxation[0, 1, 0, 1]) - stress[1, 1],
    }


def disks_in_ase(packing: Packing) -> Any:
    """Atoms of ASE with matscipy's calculator."""
    import ase
    from matscipy.calculators.polydisperse import Polydisperse

    mean_diameters(packing)
    assert packing.diameters is not None
    cell = np.diag([0.0, 0.0, HEIGHT])
    cell[:2, :2] = packing.box
    positions = np.column_stack([packing.positions, np.zeros(packing.n)])
    atoms = ase.Atoms(numbers=np.ones(packing.n), positions=positions, cell=cell, pbc=True)
    atoms.set_array("size", packing.diameters.copy())
    atoms.calc = Polydisperse(SoftDisks(packing.params["eps"], float(packing.diameters.max())))
    return atoms


class SoftDisks:
    """U = (eps/2)(1 - r/s)^2, with s the mean of two diameters, as matscipy's `Polydisperse` asks for a law."""

    def __init__(self, eps: float, largest: float) -> None:
        self.eps, self.largest = eps, largest

    def __call__(self, r: Array, s: Array) -> Array:
        """Energy at distances r."""
        return 0.5 * self.eps * (1 - r / s) ** 2

    def first_derivative(self, r: Array, s: Array) -> Array:
        """dU/dr."""
        return -self.eps * (1 - r / s) / s

    def second_derivative(self, r: Array, s: Array) -> Array:
        """d2U/dr2."""
        return self.eps / s**2 * np.ones_like(r)

    def derivative(self, order: int) -> Any:
        """First or second derivative, which some versions ask for in this way."""
        return {1: self.first_derivative, 2: self.second_derivative}[order]

    def mix_sizes(self, a: Array, b: Array) -> Array:
        """Distance at which two disks touch."""
        return 0.5 * (a + b)

    def get_cutoff(self) -> float:
        """In parts of that distance."""
        return 1.0

    def get_maxSize(self) -> float:  # noqa: N802, matscipy's own spelling
        """Of all disks."""
        return self.largest


class ASE(Peer):
    """Disks in one plane of a periodic box, by matscipy's neighbour list."""

    name = "ASE, matscipy"
    package = "ase"
    method = "FIRE"

    def evaluate(self, packing: Packing) -> Point:
        atoms = disks_in_ase(packing)
        stress = -HEIGHT * atoms.get_stress(voigt=False)[:2, :2]  # ASE: positive in tension, per volume
        energy = float(atoms.get_potential_energy())
        return Point(energy, atoms.get_forces()[:, :2], stress, 0.5 * float(np.trace(stress)))

    def descent(self, packing: Packing) -> Descent:
        """Prepare FIRE with steps bounded as in jamlab; every run sets up its own Atoms."""
        from ase.optimize import FIRE

        def run(force: float, steps: int) -> Array:
            atoms = disks_in_ase(packing)
            FIRE(atoms, logfile=None, dt=0.1, maxstep=0.1).run(fmax=force, steps=steps)
            return np.array(atoms.positions[:, :2])

        return run


def order_by_freud(packing: Packing) -> dict[str, Any]:
    """Number of contacts, and |psi_6| of every disk, in a process of its own: both freud and liblammps bring voro++,
    and where LAMMPS was opened first, freud would call LAMMPS' and crash."""
    return run_side_by_side(_measure, [packing], 1)[0]


def _measure(packing: Packing, _: Any) -> dict[str, Any]:
    import freud

    lattice = np.zeros((3, 3))
    lattice[:2, :2] = packing.box.T  # columns are lattice vectors
    box = freud.box.Box.from_matrix(lattice, dimensions=2)
    points = box.wrap(np.column_stack([packing.positions, np.zeros(packing.n)]))
    assert packing.diameters is not None
    query = {"r_max": float(packing.diameters.max()), "exclude_ii": True}
    near = freud.locality.AABBQuery(box, points).query(points, query).toNeighborList()
    i, j = np.asarray(near.point_indices), np.asarray(near.query_point_indices)
    touch = np.asarray(near.distances) < 0.5 * (packing.diameters[i] + packing.diameters[j])
    cells = freud.locality.Voronoi().compute((box, points))
    order = freud.order.Hexatic(k=6).compute((box, points), neighbors=cells.nlist)
    return {"contacts": int(touch[i < j].sum()), "|psi_6|": np.abs(order.particle_order)}


ANALYSTS = (Analyst("matscipy", "matscipy", elasticity_by_matscipy), Analyst("freud", "freud-analysis", order_by_freud))
