"""What views of a packing do to numbers, and those of its structure in a form that views can be compared by."""

import numpy as np

import jamlab
from jamlab.packing.natural_units import mean_size

NUMBER, LENGTH, AREA, ENERGY, FORCE, STRESS = (0, 0), (0, 1), (0, 2), (1, 0), (1, -1), (1, -2)  # of energy and length
EACH, SET, ALL = "a row a particle", "in no order", "grows with the cell"


def waves(function, unit):
    """A mirror gives the wavevectors in another order."""

    def call(view):
        found = function(view.packing, 9.0 / mean_size(view.packing))
        return {"k": (found.k, ((0, -1), SET)), "values": (found.values, (unit, SET))}

    return call


def waves_of_motion(view):
    """Displacements per strain, in slow shear and at a frequency."""

    def powers(omega):
        found = jamlab.displacement_spectrum(view.packing, 6.0 / mean_size(view.packing), omega)
        return {"k": found.k, "transverse": found.transverse, "longitudinal": found.longitudinal}

    return {
        f"{name}, {omega}": (values, ((0, -1) if name == "k" else AREA, SET))
        for omega in (None, 1e-2)
        for name, values in powers(omega).items()
    }


def pairs(view):
    size = mean_size(view.packing)
    found = jamlab.pair_correlation(view.packing, size * np.linspace(0.0, 4.0, 30))
    return {"g": (found.g, NUMBER), "partial": (found.partial, NUMBER), "sizes": (found.sizes, LENGTH)}
