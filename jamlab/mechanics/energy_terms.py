"""Energy of a packing as a sum of small terms, each with its gradient and Hessian in closed form.

A term depends on a few positions only: two disks; the two ends of an edge; a vertex and an edge; all vertices of one
polygon. Every analysis that needs stiffness (elastic moduli, normal modes, G*(omega), Newton steps) is assembled from
this one list, for all models alike. It is evaluated in numpy, apart from the LAMMPS forces of the engine.
"""

from jamlab.packing.derived import per_packing
from jamlab.packing.packing import Packing
from jamlab.packing.terms import Terms


@per_packing
def energy_terms(packing: Packing, *, prestress: bool = True) -> list[Terms]:
    """Build all terms of the potential energy of a packing. `prestress`: False leaves out the part of each Hessian that
    is proportional to the force in the contact (Baumgarten & Tighe eq 4 with f0 = 0): every contact is replaced by an
    unstressed spring. SP only."""
    return packing.kind.terms(packing, prestress)
