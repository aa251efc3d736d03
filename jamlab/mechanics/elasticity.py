"""Static elastic moduli by linear response: the affine (Born) part minus what non-affine relaxation takes back.

With the energy's second derivatives K_uu, K_uE, K_EE (see `jamlab.mechanics.stiffness`) the elastic tensor is
C = (K_EE - K_uE^T K_uu^-1 K_uE)/A. One factorisation gives every modulus in every direction.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.mechanics.factors import SOFT, UnstableError, instability, response_and_looseness
from jamlab.mechanics.floppy_modes import floppy_modes, least_along
from jamlab.mechanics.force_network import ForceNetwork, force_network
from jamlab.mechanics.negative_moduli import warn_of_negative
from jamlab.mechanics.static_response import StrainStiffness, respond, rows_of, strain_stiffness
from jamlab.mechanics.stiffness import energy_terms, solved_coordinates, stiffness, stress
from jamlab.packing.area_change import ISOTROPIC, compression
from jamlab.packing.derived import per_packing
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE, RED

MODULI_DEFINITION = 1  # versions, see jamlab.campaign.tasks
# G(angle) holds harmonics up to 4 angle, so three equally spaced angles average exactly
_TURNED = 1e-9  # square of a floppy mode less its mean, below which it is a translation
AVERAGING_ANGLES = np.pi * np.arange(3) / 3
_DIRECTIONS = np.pi * np.arange(180) / 180  # of shear, among which the lowest modulus is looked for


@dataclass(frozen=True)
class ElasticTensor(Result):
    """Response of a packing to a homogeneous displacement gradient E.

    Attributes:
        affine: (2, 2, 2, 2) K_EE/A, all sites follow the strain.
        relaxed: (2, 2, 2, 2) C, sites relax; d2(U/A)/dE dE at force balance.
        displacements: (n_sites, 2, 2, 2) non-affine displacement du[i]/dE[k, l]; 0 for rattlers. The
            displacement along floppy modes, of sticky networks and along flat walls, is 0.
        unit: unit of the moduli, for labels.
        pressure: of the packing, which the bulk modulus depends on.

    `to_dataframe()` has the components c_11 ... c_23 (1 = xx, 2 = yy, 3 = xy), g and b of `jamlab.measure`, and
    Poisson's ratio nu = (b - g)/(b + g) in two dimensions.

    Example:
        >>> t = jamlab.elastic_tensor(jamlab.pack(n=32, pressure=1e-2, seed=1))
        >>> t.affine.shape, t.displacements.shape, bool(t.affine[0, 1, 0, 1] > t.relaxed[0, 1, 0, 1])
        ((2, 2, 2, 2), (32, 2, 2, 2), True)
    """

    _rows = ("affine", "relaxed")
    _apart = ("displacements",)

    affine: Array
    relaxed: Array
    displacements: Array
    unit: str = field(default="", repr=False)
    pressure: float = float("nan")

    def _columns(self) -> dict[str, Any]:
        """Both tensors in Voigt's notation, 1 = xx, 2 = yy, 3 = xy, as numpy orders them: the response to an extension
        along an axis or to `direction="simple"`; and what follows of isotropic moduli, means over directions."""
        tensors = np.array([self.relaxed, self.affine])
        places = {"1": (0, 0), "2": (1, 1), "3": (0, 1)}
        found: dict[str, Any] = {"response": ["relaxed", "affine"]}
        found |= {f"c_{a}{b}": tensors[:, *places[a], *places[b]] for a, b in ("11", "22", "12", "33", "13", "23")}
        g = np.array([modulus_along(c, AVERAGING_ANGLES).mean() for c in tensors])
        b = np.array([ISOTROPIC.modulus(c, self.pressure * np.eye(2)) for c in tensors])
        return found | {"g": g, "g_x": found["c_33"], "b": b, "nu": (b - g) / (b + g)}

    @drawn("Line2D, of both curves")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the shear modulus over the direction of shear, relaxed (solid) and affine (dashed); dotted: its mean.

        >>> ax = jamlab.elastic_tensor(jamlab.pack(n=64, pressure=1e-2, seed=1)).plot()
        """
        angles = np.linspace(0, np.pi, 181)
        for name, c, line, colour in (("relaxed", self.relaxed, "-", BLUE), ("affine", self.affine, "--", RED)):
            look = merged_line({"color": colour, "linestyle": line, "label": name}, style)
            axes.plot(np.degrees(angles), modulus_along(c, angles), **look)
        mean = float(modulus_along(self.relaxed, AVERAGING_ANGLES).mean())
        axes.axhline(mean, color=BLACK, linestyle=":", linewidth=1.4, label=f"mean, relaxed: {mean:.4g}")
        axes.set_xticks(np.arange(0, 181, 45))
        axes.set_xlim(0, 180)
        axes.margins(y=0.25)
        label_axes(axes, "direction of shear, degrees from x", in_unit("shear modulus $G$", self.unit))
        axes.legend(fontsize=LEGEND)


@checked
def elastic_tensor(packing: Packing, *, prestress: bool = True) -> ElasticTensor:
    """Compute the affine and the relaxed elastic tensor, without rattlers.

    Args:
        packing: SP or DP at an energy minimum.
        prestress: see `jamlab.mechanics.stiffness.energy_terms`.

    Warns:
        JamlabWarning: B, or G along some direction, is negative: the packing is unstable at its box shape.

    Raises:
        InputError: the packing has walls, between which only two strains are defined, see `jamlab.packing.frame`.
        ConvergenceError: no backbone, not at a minimum, or a negative or floppy mode of the backbone (`UnstableError`).

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> c = jamlab.elastic_tensor(p).relaxed
        >>> bool(np.isclose(c[0, 1, 0, 1], jamlab.shear_modulus(p, direction="simple")))
        True
    """
    packing.frame.check_admitted(np.eye(4), "the elastic tensor")
    found = linear_response(packing, prestress=prestress)
    along = modulus_along(found.relaxed, _DIRECTIONS)
    lowest = f"G along {np.degrees(_DIRECTIONS[along.argmin()]):.0f} degrees"
    bulk = compression(packing).modulus(found.relaxed, stress(packing))
    warn_of_negative(packing, {lowest: along.min(), "B": bulk})
    return found


def linear_response(packing: Packing, *, prestress: bool = True, named: int = SOFT.named) -> ElasticTensor:
    """The response of `elastic_tensor`, without its warning, of which those who ask for one strain take what is
    defined for it. `named`: how many modes an `UnstableError` holds at most."""
    return _response(packing, prestress, named)


@per_packing
def _response(packing: Packing, prestress: bool, named: int) -> ElasticTensor:
    network, frame = force_network(packing), packing.frame
    network.check_known()
    row = rows_of(network.held, frame.free_sites, frame.all_free)
    if frame.kept_shapes.any():
        network.check_at_rest()
        found = _beside_floppy_modes(network, row, _of_fixed_droplets(network, prestress), named)
    else:
        terms = energy_terms(packing, prestress=prestress)
        quick = respond(terms, row, packing.law.floppy)
        network.check_balance(frame.hold(quick.forces))
        found = (quick.affine, quick.back, quick.displacements)
        if not quick.firm:
            found = _beside_floppy_modes(network, row, strain_stiffness(terms, row), named, unstable=quick.unstable)
    affine, back, displacements = found
    moduli = (affine / packing.area, (affine - back) / packing.area)
    unit = packing.unit_names.stress
    return ElasticTensor(*moduli, displacements, unit, compression(packing).pressure(stress(packing)))


def _of_fixed_droplets(network: ForceNetwork, prestress: bool) -> StrainStiffness:
    """Second derivatives where strains bend the outlines of fixed droplets."""
    k, moving = stiffness(network.packing, prestress=prestress), solved_coordinates(network.packing)
    return StrainStiffness(k.uu[moving][:, moving].tocsc(), k.ue.reshape(-1, 4)[moving], k.ee)


def _beside_floppy_modes(
    network: ForceNetwork, row: NDArray[np.int64], k: StrainStiffness, named: int, *, unstable: bool = False
) -> tuple[Array, Array, Array]:
    """K_EE, K_uE^T K_uu^-1 K_uE, and the displacements of all sites. `unstable`: the matrix is known to be."""
    packing, held = network.whole, np.repeat(network.held, 2)
    moving = np.repeat(row >= 0, 2)[held]

    def everywhere(u: Array) -> Array:
        """Of all sites of the network, along the last axis."""
        found = np.zeros((*u.shape[:-1], len(moving)))
        found[..., moving] = u
        return found

    try:
        if unstable:
            raise instability(k.uu, named)
        solution, loose = response_and_looseness(k.uu, k.ue, packing.law.floppy, named)
    except UnstableError as error:
        error.modes = everywhere(error.modes)
        raise
    displacements = everywhere(-solution.T).T
    if loose:
        modes = everywhere(floppy_modes(k.uu, packing.law.floppy).T).T
        displacements += _shortest(modes, displacements, packing)
    found = np.zeros((len(packing.positions), 2, 2, 2))
    found[network.held] = displacements.reshape(-1, 2, 2, 2)
    return k.ee, -(displacements[moving].T @ k.ue).reshape(2, 2, 2, 2), found


def _shortest(modes: Array, u: Array, packing: Packing) -> Array:
    """(n, j) motion along floppy modes (n, k) that makes displacements (n, j) as short as can be, less their mean."""

    def apart(u: Array) -> Array:
        u = u.reshape(len(u) // 2, 2, u.shape[1])  # of no mode as well
        return np.asarray(u - packing.frame.drift(u)).reshape(2 * len(u), u.shape[2])

    relative = apart(modes)
    return least_along(modes, relative.T @ relative, relative.T @ apart(u), _TURNED)


def modulus_along(c: Array, angles: Array) -> Array:
    """(m,) shear moduli of an elastic tensor c, (2, 2, 2, 2), for shear along m directions, radian."""
    a = np.column_stack([np.cos(angles), np.sin(angles)])
    b = np.column_stack([-np.sin(angles), np.cos(angles)])
    return np.asarray(np.einsum("ni,nj,ijkl,nk,nl->n", a, b, c, a, b))


def mean_shear_modulus(packing: Packing, c: Array) -> float:
    """Mean over directions of the shear modulus of an elastic tensor c; nan where the packing does not admit all."""
    if not packing.frame.admits(np.eye(4)):
        return float("nan")
    return float(modulus_along(c, AVERAGING_ANGLES).mean())
