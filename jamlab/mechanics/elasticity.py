"""Static elastic moduli by linear response: the affine (Born) part minus what non-affine relaxation takes back.

With the energy's second derivatives K_uu, K_uE, K_EE (see `jamlab.mechanics.stiffness`) the elastic tensor is
C = (K_EE - K_uE^T K_uu^-1 K_uE)/A. One factorisation gives every modulus in every direction.

Near onset the sliding of disks at contacts and their non-affine motion diverge as p^(-1/4) while approach vanishes as
p^(1/4), Baumgarten & Tighe eqs 19-21 and fig 5; that is why the damping of sliding decides the viscosity, eq 22.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import ConvergenceError, Renamed
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.mechanics.factors import NAMED, UnstableError, response_and_looseness
from jamlab.mechanics.floppy_modes import floppy_modes, least_along
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.negative_moduli import warn_of_negative
from jamlab.mechanics.stiffness import solved_coordinates, stiffness, stress
from jamlab.packing.area_change import ISOTROPIC, compression
from jamlab.packing.deformation import at_phi
from jamlab.packing.derived import per_packing
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.packing.strain_map import SIMPLE_SHEAR, admits, check_admitted, wall_offsets
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE, GREEN, RED

MODULI_DEFINITION = 1  # versions, see jamlab.campaign.tasks
NONAFFINE_DEFINITION = 2  # 1 left open how disks move along floppy modes
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
        InputError: the packing has walls, between which only two strains are defined, see `jamlab.packing.strain_map`.
        ConvergenceError: no backbone, not at a minimum, or a negative or floppy mode of the backbone (`UnstableError`).

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> c = jamlab.elastic_tensor(p).relaxed
        >>> bool(np.isclose(c[0, 1, 0, 1], jamlab.shear_modulus(p)))
        True
    """
    check_admitted(packing, np.eye(4), "the elastic tensor")
    found = linear_response(packing, prestress=prestress)
    along = modulus_along(found.relaxed, _DIRECTIONS)
    lowest = f"G along {np.degrees(_DIRECTIONS[along.argmin()]):.0f} degrees"
    bulk = compression(packing).modulus(found.relaxed, stress(packing))
    warn_of_negative(packing, {lowest: along.min(), "B": bulk})
    return found


def linear_response(packing: Packing, *, prestress: bool = True) -> ElasticTensor:
    """The response of `elastic_tensor`, without its warning, of which those who ask for one strain take what is
    defined for it."""
    return _response(packing, prestress, NAMED)


@per_packing
def _response(packing: Packing, prestress: bool, named: int) -> ElasticTensor:
    network = force_network(packing)
    network.check_at_rest()
    k = stiffness(network.packing, prestress=prestress)
    right = k.ue.reshape(-1, 4)
    solution = np.zeros_like(right)
    moving = solved_coordinates(network.packing)
    if len(moving):  # one particle that presses on its own images moves with the box alone
        try:
            matrix = k.uu[moving][:, moving].tocsc()
            solution[moving], loose = response_and_looseness(matrix, right[moving], packing.law.floppy, named)
            if loose:
                floppy = floppy_modes(matrix, packing.law.floppy)
                modes = np.zeros((len(right), floppy.shape[1]))
                modes[moving] = floppy
                solution += _shortest(modes, solution, network.packing)
        except UnstableError as error:
            modes = np.zeros((len(error.modes), len(right)))
            modes[:, moving] = error.modes
            error.modes = modes
            raise
    response = (solution.T @ right).reshape(2, 2, 2, 2)
    displacements = np.zeros((len(packing.positions), 2, 2, 2))
    displacements[network.held] = -solution.reshape(-1, 2, 2, 2)
    unit = packing.unit_names.stress
    moduli = (k.ee / packing.area, (k.ee - response) / packing.area)
    return ElasticTensor(*moduli, displacements, unit, compression(packing).pressure(stress(packing)))


def _shortest(modes: Array, solution: Array, packing: Packing) -> Array:
    """(n, j) motion along floppy modes (n, k) that makes displacements (n, j) as short as can be, less their mean."""

    def apart(u: Array) -> Array:
        u = u.reshape(-1, 2, u.shape[1])
        return np.asarray(u - u.mean(axis=0) if packing.fixed is None else u).reshape(-1, u.shape[2])

    relative = apart(modes)
    return least_along(modes, relative.T @ relative, relative.T @ apart(solution), _TURNED)


def modulus_along(c: Array, angles: Array) -> Array:
    """(m,) shear moduli of an elastic tensor c, (2, 2, 2, 2), for shear along m directions, radian."""
    a = np.column_stack([np.cos(angles), np.sin(angles)])
    b = np.column_stack([-np.sin(angles), np.cos(angles)])
    return np.asarray(np.einsum("ni,nj,ijkl,nk,nl->n", a, b, c, a, b))


def mean_shear_modulus(packing: Packing, c: Array) -> float:
    """Mean over directions of the shear modulus of an elastic tensor c; nan where the packing does not admit all."""
    if not admits(packing, np.eye(4)):
        return float("nan")
    return float(modulus_along(c, AVERAGING_ANGLES).mean())


def follow(packing: Packing, phi: float) -> Packing:
    """Predict the packing at another nominal packing fraction by linear response. Near onset a prediction keeps all
    overlaps in proportion, so that no contact opens or closes; an affine guess would change most of them. Rattlers move
    with the box; so does all of a packing that has no stable response."""
    moved = at_phi(packing, phi)
    try:
        tensor = linear_response(packing)
    except ConvergenceError:
        return moved
    strain = compression(packing).gradient(packing.phi / phi) - np.eye(2)
    held = force_network(packing).held & ~packing.fixed_sites
    response = np.einsum("nkij,ij->nk", tensor.displacements, strain)
    positions = moved.positions.copy()
    positions[held] = (packing.positions @ (np.eye(2) + strain).T + response)[held]
    return moved.with_state(positions=positions)


def unstable_directions(packing: Packing, named: int = NAMED) -> tuple[Array, float, int] | None:
    """Displacements (k, n_sites, 2), the largest 1, along modes that give way, the lowest first, its eigenvalue, 0
    where rounding hides it, and how many give way, of which k may be fewer, beyond `named`; None for a minimum, for a
    loose packing, and for forces so large beside the pressure that no Hessian tells."""
    try:
        _response(packing, True, named)
    except UnstableError as error:
        modes = error.modes.reshape(len(error.modes), -1, 2)
        directions = np.zeros((len(modes), *packing.positions.shape))
        # with one site fixed, all others may move where its own droplet slides
        whole = modes.mean(axis=1, keepdims=True) if packing.fixed is None else 0.0
        directions[:, force_network(packing).held] = modes - whole
        return directions / np.abs(directions).max(axis=(1, 2), keepdims=True), error.eigenvalue, error.count
    except ConvergenceError:
        return None
    return None


@dataclass(frozen=True)
class NonaffineResponse(Result):
    """Relative and non-affine displacements per unit of strain gamma of x -> x + gamma y, in the unit of length.

    Attributes:
        normal: (m,) relative displacement along the line of centres of every contact of the backbone, the affine part
            included; positive where disks separate.
        tangential: (m,) the same perpendicular to that line, counter-clockwise.
        nonaffine_tangential: (m,) likewise, of the non-affine displacements alone.
        nonaffine: (n', 2) displacement of every disk of the backbone less the affine one and less the mean.
        unit: unit of length, for labels.

    Example:
        >>> s = jamlab.nonaffine_response(jamlab.pack(n=32, pressure=1e-2, seed=1))
        >>> bool(np.isclose(s.median_normal, np.median(np.abs(s.normal))))
        True
    """

    _rows = ("normal", "tangential", "nonaffine_tangential")
    _apart = ("nonaffine",)

    normal: Array
    tangential: Array
    nonaffine_tangential: Array
    nonaffine: Array
    unit: str = field(default="", repr=False)

    sliding = Renamed("nonaffine_tangential")

    @property
    def median_normal(self) -> float:
        """Median of |normal|, ~ p^(1/4)."""
        return float(np.median(np.abs(self.normal)))

    @property
    def median_tangential(self) -> float:
        """Median of |tangential|, ~ p^(-1/4)."""
        return float(np.median(np.abs(self.tangential)))

    @property
    def median_nonaffine(self) -> float:
        """Median length of the non-affine displacement, ~ p^(-1/4)."""
        return float(np.median(np.hypot(*self.nonaffine.T)))

    @drawn("Line2D, of all three curves")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the distributions of |approach|, |sliding| and non-affine displacement, medians in the legend.

        >>> ax = jamlab.nonaffine_response(jamlab.pack(n=64, pressure=1e-3, seed=1)).plot()
        """
        parts = (
            ("approach", np.abs(self.normal), "-", BLUE),
            ("sliding", np.abs(self.tangential), "--", RED),
            ("non-affine", np.hypot(*self.nonaffine.T), "-.", GREEN),
        )
        for name, values, line, colour in parts:
            lengths = values[values > 0]
            zero = len(values) - len(lengths)
            label = f"{name}, median {np.median(values):.3g}" + (f", {zero} that do not move left out" if zero else "")
            if len(lengths):
                axes.ecdf(lengths, **merged_line({"color": colour, "linestyle": line, "label": label}, style))
        axes.set_xscale("log")
        label_axes(axes, in_unit(r"displacement per strain", self.unit), "share that is smaller")
        axes.legend(fontsize=LEGEND)


@checked
def nonaffine_response(packing: Packing, *, prestress: bool = True) -> NonaffineResponse:
    """Compute the quasi-static response of each contact to shear: normal, tangential and non-affine displacements.

    Between walls the shear moves the upper wall as a whole, so the displacement of wall particles is not affine.
    Networks of sticky disks and slabs between flat walls have floppy modes: the displacement along them is 0, which is
    the smallest response that balances forces.

    Args:
        packing: SP at an energy minimum.
        prestress: False replaces contacts by unstressed springs, as in fig 5 of Baumgarten & Tighe.

    Raises:
        InputError: a packing of droplets.
        ConvergenceError: see `jamlab.mechanics.elasticity.elastic_tensor`.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> s = jamlab.nonaffine_response(p)
        >>> len(s.normal) == jamlab.contacts(p).n_contacts, bool(s.median_tangential > s.median_normal)
        (True, True)
    """
    network = force_network(packing)
    touching = touching_disks(network.packing)  # refuses droplets
    u = linear_response(packing, prestress=prestress).displacements[network.held, :, 0, 1]
    u = u + wall_offsets(network.packing) @ SIMPLE_SHEAR.T  # walls are not affine
    i, j, r = touching.i, touching.j, touching.r
    relative = u[j] - u[i]
    normal = r / np.hypot(*r.T)[:, None]
    sliding = relative[:, 1] * normal[:, 0] - relative[:, 0] * normal[:, 1]
    relative[:, 0] += r[:, 1]
    return NonaffineResponse(
        normal=np.einsum("ij,ij->i", relative, normal),
        tangential=relative[:, 1] * normal[:, 0] - relative[:, 0] * normal[:, 1],
        nonaffine_tangential=sliding,
        nonaffine=u - u.mean(axis=0) if packing.fixed is None else u,
        unit=packing.unit_names.length,
    )
