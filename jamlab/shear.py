"""The shear modulus, three ways."""

import numpy as np

from jamlab.contacts import contacts
from jamlab.deformation import sheared
from jamlab.elasticity import linear_shear_modulus
from jamlab.engine import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.packing import Packing
from jamlab.relaxation import relax
from jamlab.start import check_number

METHODS = ("linear-response", "finite-strain", "affine")

# At small strain: soft modes turn a force f that is left into an error of the stress of 100 f and more.
_FORCE = {"sp": 2e-14, "dp": 1e-13}


def shear_modulus(
    packing: Packing,
    method: str = "linear-response",
    *,
    angle: float = 0.0,
    average: bool = False,
    strain: float = 1e-6,
) -> float:
    """Shear modulus G of a packing at an energy minimum, in its units of stress.

    Boromand et al. apply an affine shear and measure the stress; without relaxation that is the affine modulus, which
    does not vanish at onset. The scaling G ~ (phi - phi_J)^0.5 belongs to the relaxed modulus.

    Args:
        packing: SP or DP.
        method: "linear-response": relaxed, from the analytic Hessian. "finite-strain": relaxed, LAMMPS shears the box
            by +-strain/2 and minimises; the strain is halved until no contact changes. "affine": without relaxation.
        angle: direction of shear, radian; 0 is along x. Not for "finite-strain".
        average: mean over all directions. Not for "finite-strain".
        strain: for "finite-strain", where to start.

    Raises:
        InputError: unknown method, or an option that the method cannot do.
        ConvergenceError: not jammed, not at a minimum, or contacts change at every strain tried.
    """
    if method not in METHODS:
        raise InputError(f"unknown method {method!r}: use one of {', '.join(METHODS)}")
    if method != "finite-strain":
        return linear_shear_modulus(packing, affine=method == "affine", angle=angle, average=average)
    if angle or average:
        raise InputError("finite-strain shears the box along x only: use linear-response for other directions")
    check_number("strain", strain, 0.1)
    return _finite_strain(packing, strain)


def _finite_strain(packing: Packing, strain: float) -> float:
    with Session(packing) as session:
        for _ in range(12):
            stresses, networks = [], []
            for half in (0.5 * strain, -0.5 * strain):
                session.load(sheared(packing, half))
                found = relax(session, _FORCE[packing.model], near=True)
                if not found.converged:
                    raise ConvergenceError(
                        f"no minimum at strain {half:.2g}: max force {found.evaluation.max_force:.2g} after relaxation"
                    )
                stresses.append(found.evaluation.stress[0, 1])
                networks.append(contacts(session.packing()).pairs)
            if np.array_equal(networks[0], networks[1]):
                return float((stresses[1] - stresses[0]) / strain)
            strain *= 0.5
    raise ConvergenceError(
        f"contacts change even at strain {strain:.2g}: G of this packing is not defined by finite strain"
    )
