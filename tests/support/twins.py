"""A third model from outside of jamlab: twins, two disks of one size on a stiff spring, with a deck part of its own."""

from contextlib import contextmanager
from pathlib import Path

import numpy as np

from jamlab.laws.parameter import STRENGTHS, Parameter
from jamlab.laws.power import PowerLaw
from jamlab.models.round_sites import RoundSites
from jamlab.packing.kinds import MODELS
from jamlab.packing.model import Model
from jamlab.packing.terms import central_terms


class Twins(RoundSites):
    name = "twin"
    particles = "twins"
    words = ("twins",)
    sites = 2
    atom_style = "molecular"
    bonds_by_size = True
    part = Path(__file__).with_name("twins.lammps")

    def parameters(self, units, params):
        each = Parameter(energy=1, length=-2)
        return {"eps": STRENGTHS["eps"], "bond": each, "aspect": Parameter(least=0.01, largest=0.99)}

    def law(self, packing):
        return PowerLaw("eps", float(packing.params["eps"]))

    def shape(self, diameters, params):
        half = 0.5 * params["aspect"] * diameters
        return np.stack([np.column_stack([-half, 0 * half]), np.column_stack([half, 0 * half])], axis=1)

    def lammps_variables(self, packing):
        return Model.lammps_variables(self, packing)  # of a part of its own

    def free_area(self, packing):  # two disks without the lens that they share
        a = packing.params["aspect"]
        return float(np.sum(packing.diameters**2) * (np.pi / 2 - (np.arccos(a) - a * np.sqrt(1 - a * a)) / 2))

    def shape_terms(self, packing):
        bonds, stiffness = self.bonds(packing), packing.params["bond"]
        r = np.diff(packing.positions[bonds], axis=1)[:, 0]
        length = np.hypot(*r.T)
        stretch = length - packing.params["aspect"] * packing.diameters
        normal, slope = r / length[:, None], stiffness * stretch
        along = np.full(len(r), stiffness)
        return [central_terms("tension", bonds, r, normal, 0.5 * stiffness * stretch**2, slope, along, slope / length)]


TWINS = Twins()


@contextmanager
def registered():
    """Twins as a package of somebody else registers them, for a while."""
    MODELS.register("twin", TWINS)
    try:
        yield TWINS
    finally:
        del MODELS._entries["twin"]
