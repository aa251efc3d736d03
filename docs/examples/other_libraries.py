"""The same packings in matscipy and freud: `python docs/examples/other_libraries.py`.

matscipy has the non-affine elastic constants of any pair potential, freud Voronoi neighbours and psi_6; both need
`pip install '.[peers]'`. Prints the largest differences over a few packings.
"""

import ase
import freud
import numpy as np
from matscipy.calculators.polydisperse import Polydisperse

import jamlab

HEIGHT = 20.0  # of the box of matscipy, which is three-dimensional; forces stay in the plane


class HarmonicDisks:
    """U = (k/2)(s - r)^2 with k = 1, s the mean of two diameters, as `Polydisperse` of matscipy asks for it."""

    def __init__(self, diameters: np.ndarray) -> None:
        self.largest = float(diameters.max())

    def __call__(self, r: np.ndarray, s: np.ndarray) -> np.ndarray:
        return 0.5 * (s - r) ** 2

    def first_derivative(self, r: np.ndarray, s: np.ndarray) -> np.ndarray:
        """dU/dr."""
        return r - s

    def second_derivative(self, r: np.ndarray, s: np.ndarray) -> np.ndarray:
        """d2U/dr2."""
        return np.ones_like(r)

    def derivative(self, order: int):
        """First or second derivative, which some versions ask for in this way."""
        return {1: self.first_derivative, 2: self.second_derivative}[order]

    def mix_sizes(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Distance at which two disks touch."""
        return 0.5 * (a + b)

    def get_cutoff(self) -> float:
        """In parts of that distance."""
        return 1.0

    def get_maxSize(self) -> float:  # noqa: N802
        """Of all disks."""
        return self.largest


def in_matscipy(p: jamlab.Packing) -> tuple[float, np.ndarray, float]:
    """Energy, forces and relaxed shear modulus along x."""
    cell = np.diag([0.0, 0.0, HEIGHT])
    cell[:2, :2] = p.box
    atoms = ase.Atoms(f"H{p.n}", positions=np.column_stack([p.positions, np.zeros(p.n)]), cell=cell, pbc=True)
    atoms.set_array("size", p.diameters.copy())
    atoms.calc = Polydisperse(HarmonicDisks(p.diameters))
    born = atoms.calc.get_property("born_constants", atoms)
    relaxation = atoms.calc.get_property("nonaffine_elastic_contribution", atoms)
    # second derivative by simple shear x -> x + gamma y instead of the symmetric strain of Born's constants
    stress = -atoms.get_stress(voigt=False)[1, 1]
    modulus = HEIGHT * (born[0, 1, 0, 1] + relaxation[0, 1, 0, 1] - stress)
    return atoms.get_potential_energy(), atoms.get_forces()[:, :2], modulus


def in_freud(p: jamlab.Packing) -> np.ndarray:
    """|psi_6| of every disk over its Voronoi neighbours."""
    lattice = np.zeros((3, 3))
    lattice[:2, :2] = p.box.T  # columns are lattice vectors
    box = freud.box.Box.from_matrix(lattice, dimensions=2)
    points = box.wrap(np.column_stack([p.positions, np.zeros(p.n)]))
    cells = freud.locality.Voronoi().compute((box, points))
    order = freud.order.Hexatic(k=6).compute((box, points), neighbors=cells.nlist)
    return np.abs(order.particle_order)


def compare(seeds: range) -> dict[str, float]:
    """Largest differences over the packings, rattlers left out: they leave matscipy's Hessian singular."""
    found: dict[str, list[float]] = {"energy": [], "force": [], "G": [], "psi_6": []}
    for seed in seeds:
        p = jamlab.without_rattlers(jamlab.pack(n=64, pressure=1e-2, seed=seed))
        here = jamlab.evaluate(p)
        energy, forces, modulus = in_matscipy(p)
        found["energy"].append(abs(energy / here.energy - 1))
        found["force"].append(np.abs(forces - here.forces).max())
        found["G"].append(abs(modulus - jamlab.shear_modulus(p)))
        found["psi_6"].append(np.abs(in_freud(p) - np.abs(jamlab.orientational_order(p).local)).max())
    return {name: max(values) for name, values in found.items()}


if __name__ == "__main__":
    for name, difference in compare(range(1, 6)).items():
        print(f"{name:7s} {difference:.1e}")
