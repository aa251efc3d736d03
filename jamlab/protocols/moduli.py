"""The shear modulus G and the bulk modulus B, three ways each.

Boromand et al. apply an affine shear and measure the stress; without relaxation that is the affine modulus, which does
not vanish at onset. The scaling G ~ (phi - phi_J)^0.5 belongs to the relaxed modulus.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import cast, overload

import numpy as np
from numpy.typing import NDArray

from jamlab.arguments.choices import Direction, ModulusMethod, ShearName
from jamlab.arrays import Array, ArrayLike
from jamlab.checks import check_number, checked
from jamlab.engine.deck_defaults import numbers
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, linear_response, modulus_along
from jamlab.mechanics.negative_moduli import warn_of_negative
from jamlab.mechanics.stiffness import pressure, stress
from jamlab.packing.area_change import compression
from jamlab.packing.deformation import at_phi, deformed
from jamlab.packing.natural_units import in_natural_units, mean_size, stiffness_scale
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing
from jamlab.packing.quantities import STRESS
from jamlab.packing.shear_direction import ShearDirection, shear_direction
from jamlab.protocols.relaxation import relax_session

# At small strain soft modes turn a force f that is left into an error of the stress of 100 f and more; Newton steps on
# LAMMPS forces reach `Model.least_force`, the minimisers of plain decks do not.
_LEFT = 1e3  # times that may be left: rounding leaves ten times as much, a minimum that was missed far more


@overload
def shear_modulus(
    packing: Packing,
    method: ModulusMethod = "linear-response",
    *,
    direction: Direction | None = None,
    strain_step: float | None = None,
) -> float: ...
@overload
def shear_modulus(
    packing: Packing,
    method: ModulusMethod = "linear-response",
    *,
    direction: Sequence[float] | Array,
    strain_step: float | None = None,
) -> Array: ...


@checked
def shear_modulus(
    packing: Packing,
    method: ModulusMethod = "linear-response",
    *,
    direction: ShearName | ArrayLike | None = None,
    strain_step: float | None = None,
) -> float | Array:
    """Shear modulus G of a packing at an energy minimum, in its units of stress: the mean over all directions of shear.

    G is the second derivative of the energy per area with respect to the strain. Small packings are anisotropic; in a
    fixed box G can be negative near onset. Between walls shear along x alone is defined, so `direction="simple"`.

    Args:
        packing: SP or DP.
        method: "linear-response": relaxed, from the analytic Hessian. "finite-strain": relaxed, LAMMPS shears the box
            by +-strain_step/2 and minimises; the strain is halved until no contact changes. "affine": without
            relaxation.
        direction: None, the default: the mean over all directions of simple shear. "simple": along x; "pure":
            extension along x, compression along y; an angle in radians: simple shear along (cos, sin); or (m,) such
            angles.
        strain_step: first strain of "finite-strain"; default 1e-6, DP 3e-7.

    Returns:
        G; (m,) float64 if `direction` is an array.

    Warns:
        JamlabWarning: G is negative: the packing is unstable to shear at its box shape.

    Raises:
        InputError: invalid method, direction or strain_step; a mean or a direction that walls do not define.
        ConvergenceError: unjammed, not at a minimum, or contacts change at every strain.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> g, along_x = jamlab.shear_modulus(p), jamlab.shear_modulus(p, direction="simple")
        >>> along = jamlab.shear_modulus(p, direction=np.linspace(0, np.pi, 8, endpoint=False))
        >>> bool(np.isclose(along.mean(), g)), bool(along[0] == along_x)
        (True, True)
        >>> bool(np.isclose(g, jamlab.shear_modulus(p, "finite-strain"), rtol=1e-3))
        True
        >>> jamlab.shear_modulus(p, "affine") > g
        True
    """
    directions = _directions(packing, direction)
    first = _first_strain(packing, method, strain_step)
    if method == "finite-strain":
        moduli = _sheared(packing, directions, first)
    else:
        tensor, now = linear_response(packing), stress(packing)
        c = tensor.affine if method == "affine" else tensor.relaxed
        if direction is None:
            moduli = modulus_along(c, AVERAGING_ANGLES)
        else:
            moduli = np.array([each.modulus(c, now) for each in directions])
    one = direction is None or np.ndim(direction) == 0
    found = float(moduli.mean()) if one else moduli
    warn_of_negative(packing, {"G, the mean over directions," if direction is None else "G": found})
    return found


def _directions(packing: Packing, direction: ShearName | ArrayLike | None) -> list[ShearDirection]:
    """Directions of shear that are asked for; the mean of those of None is the mean over all."""
    if direction is None:
        packing.frame.check_admitted(np.eye(4), "the mean over directions, which `direction=None` asks for,")
        return [shear_direction(packing, angle) for angle in AVERAGING_ANGLES.tolist()]
    if isinstance(direction, str):
        return [shear_direction(packing, cast(ShearName, direction))]
    angles = np.asarray(direction, dtype=np.float64)
    if angles.ndim > 1 or not angles.size or not np.isfinite(angles).all():
        given = " ".join(repr(direction).split())
        raise InputError(f"direction = {given:.80}: give an angle in radians, a 1D array of angles, or a name")
    return [shear_direction(packing, angle) for angle in np.atleast_1d(angles).tolist()]


@checked
def bulk_modulus(
    packing: Packing, method: ModulusMethod = "linear-response", *, strain_step: float | None = None
) -> float:
    """Bulk modulus B = -A dp/dA of a packing at an energy minimum, in its units of stress.

    p = -dU/dA is the pressure of `jamlab.evaluate`: (S_xx + S_yy)/2 in a box of fixed shape; between walls the normal
    stress on them, S_yy, at constant width.

    Args:
        packing: SP or DP.
        method: as in `shear_modulus`.
        strain_step: first relative change of the area for "finite-strain"; default as in `shear_modulus`.

    Warns:
        JamlabWarning: B is negative: the packing is unstable to compression.

    Raises:
        InputError: unknown method, or a strain_step that is no number.
        ConvergenceError: unjammed, not at a minimum, or contacts change at every strain.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> round(jamlab.bulk_modulus(p), 3)
        0.486
    """
    first = _first_strain(packing, method, strain_step)
    if method == "finite-strain":
        found = _compressed(packing, first)
    else:
        tensor = linear_response(packing)
        found = compression(packing).modulus(tensor.affine if method == "affine" else tensor.relaxed, stress(packing))
    warn_of_negative(packing, {"B": found})
    return found


def _first_strain(packing: Packing, method: ModulusMethod, strain_step: float | None) -> float:
    if strain_step is not None and method != "finite-strain":
        raise InputError(
            f"strain_step = {strain_step!r}: method {method!r} strains nothing; leave it out or use 'finite-strain'"
        )
    if strain_step is None:
        first = numbers("strain")
        return first.get(f"strain_step_{packing.model}", first["strain_step"])
    check_number("strain_step", strain_step, 0.1)
    return strain_step


@in_natural_units(STRESS)
def _sheared(packing: Packing, directions: Sequence[ShearDirection], strain: float) -> Array:
    """(m,) finite-strain G in m directions."""
    response = linear_response(packing).displacements

    def along(direction: ShearDirection) -> float:
        def measure(step: float) -> float | None:
            stresses, states = [], []
            for change in (step / 2, -step / 2):
                state, rotation = deformed(packing, direction.gradient(change))
                found, relaxed = _minimum(session, state, response)
                stresses.append(direction.turned(rotation).conjugate(found))
                states.append(relaxed)
            return (stresses[0] - stresses[1]) / step if _same_contacts(*states) else None

        return _at_small_strain("G", packing, strain, measure)

    with Session(packing) as session:
        return np.array([along(direction) for direction in directions])


@in_natural_units(STRESS)
def _compressed(packing: Packing, strain: float) -> float:
    """Finite-strain B."""
    response = linear_response(packing).displacements

    def measure(step: float) -> float | None:
        changes = (step / 2, -step / 2)
        above, below = (_minimum(session, at_phi(packing, packing.phi * (1 + s)), response) for s in changes)
        if not _same_contacts(above[1], below[1]):
            return None
        pressures = compression(packing).pressure(above[0] - below[0])
        return pressures / float(np.log1p(step / 2) - np.log1p(-step / 2))

    with Session(packing) as session:
        return _at_small_strain("B", packing, strain, measure)


def _at_small_strain(name: str, packing: Packing, strain: float, measure: Callable[[float], float | None]) -> float:
    """Modulus at the first strain, halved again and again, at which no contact changes. Where contacts are no springs,
    weak ones stiffen within the strain: the error, which falls with its square, is extrapolated away by half the strain
    (Richardson)."""
    for step in strain * 0.5 ** np.arange(int(numbers("strain")["halvings"])):
        found = measure(step)
        if found is None:
            continue
        finer = None if packing.law.springs else measure(0.5 * step)
        return found if finer is None else (4 * finer - found) / 3
    raise ConvergenceError(
        f"contacts change even at strain {step:.2g}: {name} of this packing is not defined by finite strain"
    )


def _minimum(session: Session, packing: Packing, response: Array) -> tuple[Array, Packing]:
    """(2, 2) stress of a minimum and its packing. Rounding of positions leaves forces, which change the stress by their
    work on the displacements per strain: the last Newton step, too short for positions, is taken in the stress alone.
    `response`: (n_sites, 2, 2, 2) of `ElasticTensor.displacements`."""
    session.load(packing)
    tolerance = _force_tolerance(packing)
    found = relax_session(session, tolerance, near=True).evaluation
    if found.max_force > _LEFT * tolerance:
        raise ConvergenceError(
            f"no minimum after a small strain (residual force {found.max_force:.2g}): relax the packing first"
        )
    return found.stress + np.einsum("nk,nkij->ij", found.forces, response) / packing.area, session.packing()


def _force_tolerance(packing: Packing) -> float:
    """Residual force, smaller where contacts are softer than springs: the same force moves those farther."""
    softness = packing.law.stiffness_at(pressure(packing))
    typical = stiffness_scale(packing) * mean_size(packing)
    return packing.kind.least_force * max(1.0, typical) * softness


def _same_contacts(one: Packing, two: Packing) -> bool:
    """Whether the same images touch: in a box of two disks, a pair that parts may be replaced by another of its images.
    Images are told apart by the vectors between particles, which differ by the box; their numbers change where a
    particle is wrapped."""
    (pairs, r), (others, s) = (_sort_contacts(packing) for packing in (one, two))
    return np.array_equal(pairs, others) and bool(np.all(np.hypot(*(r - s).T) < 0.5 * np.hypot(*r.T)))


def _sort_contacts(packing: Packing) -> tuple[NDArray[np.int64], Array]:
    """Pairs that touch and vectors between them; several of one pair in the order along an odd direction."""
    found, near = contacts(packing), packing.kind.points(packing)
    if packing.kind.sites not in (None, 1) and isinstance(near, Pairs):  # two particles may change which disks meet
        pairs, r = np.column_stack([near.i, near.j]), near.r
        bearing = ~found.rattlers[packing.particle[pairs]].any(axis=1)
    else:
        pairs, r, bearing = found.pairs, found.r, found.bearing
    kept = np.ones_like(bearing) if packing.law.springs else bearing  # soft rattlers keep overlaps
    pairs, r = pairs[kept], r[kept]
    order = np.lexsort((r @ [np.cos(1.0), np.sin(1.0)], pairs[:, 1], pairs[:, 0]))
    return pairs[order], r[order]
