"""A packing: the state that every other part of jamlab takes and gives.

Models share the class. SP: soft disks, one position each. DP: deformable droplets, one position per vertex. The box is
a parallelogram with periodic boundaries; all lengths and energies are in the units of the paper that `Packing.units`
names. `Packing.kind` holds everything that depends on the model.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from jamlab.arguments.choices import Ensemble, ModelName, Units
from jamlab.arrays import Array, ArrayLike, Indices, Mask
from jamlab.checks import check_choice, checked, checked_class, finite_array, is_number
from jamlab.errors import InputError
from jamlab.face import NAMES
from jamlab.hints import Hinted
from jamlab.laws.pair_law import PairLaw
from jamlab.laws.parameter import Parameter, check_params
from jamlab.packing.derived import Derived, frozen, lock, per_packing
from jamlab.packing.frame import Frame, checked_fixed, frame_of
from jamlab.packing.kinds import MODELS, kind_of
from jamlab.packing.magnitudes import check_box
from jamlab.packing.model import Model, UnitNames
from jamlab.packing.polygons import Polygons
from jamlab.packing.quantities import MEASURED
from jamlab.packing.recipe import RECIPE, Made, recipe_of
from jamlab.plotting.drawable import CELL, drawn

# what is known of a minimum, and its values for a state that nobody minimised
MINIMUM: dict[str, Any] = {"max_force": None, "converged": False, "force_tolerance": None}
MINIMUM |= {"on_rattlers": False, "on_target": True}
KNOWN: dict[str, Any] = {**MINIMUM, "ensemble": "fixed-box", "rounding": 0.0, "fixed": None, "walls": False}
# what files keep beside the state
_STATE = frozenset({"box", "positions", "params", "diameters", "offsets", "fixed", "walls"})  # of a minimum
_DEFINING = _STATE | {"model", "units"}  # what everything that is computed of a packing follows from


@checked_class
@dataclass(frozen=True, eq=False)
class Packing(Made, Hinted):
    """Soft disks or deformable droplets in a periodic parallelogram.

    Arrays, `params` and `provenance` are read-only copies. To change them, give changed copies to `with_state`.

    Attributes:
        model: name of the model, such as sp, soft disks, or dp, deformable droplets.
        box: (2, 2) float64, rows are the lattice vectors; box[0, 1] = 0, simple shear is box[1, 0].
        positions: SP (n, 2) float64 centres. DP (n_vertices, 2) vertices; each polygon is whole (not wrapped) and
            counter-clockwise.
        params: every parameter of the force law. SP: `eps` or `k`, and `law`, its name in `jamlab.laws.laws.LAWS`
            (without one: "sticky" where `stickiness` is above 0, else "power"). DP: `gamma` (eps/l), `ka` (eps/l^4),
            `eps`, `delta` (l), `eta` (l), `contact` (one of CONTACT_FORMS) and `a0`, (n,) rest areas (l^2).
        units: "eps": Boromand et al. (energy eps; SP length: mean diameter; DP length: l = mean of sqrt(a0) over the
            two sizes). "k": Baumgarten & Tighe (stiffness k, mean diameter d, time tau_1).
        diameters: SP (n,) float64, else None.
        offsets: DP (n + 1,) int64: vertices of particle m are positions[offsets[m]:offsets[m + 1]], else None.
        phi_J: phi at onset, equal to rho there, of the packing that this one was compressed from, or None.
        ensemble: "fixed-box", or "shear-stabilized": the box is relaxed to zero shear stress.
        max_force: largest residual force of the minimisation that ended in this state; None without minimisation.
        converged: whether that minimisation met `force_tolerance`. `with_state` resets `max_force` to None and
            `converged` to False if particles, box or force law change.
        force_tolerance: largest residual force that was asked of that minimisation, or None.
        on_rattlers: whether rattlers or ends of flat edges block the sliding of droplets; the Hessian neglects this.
        on_target: whether the sweep that made this state reached the requested packing fraction.
        fixed: (n,) bool, particles that move only with strains of the box, see `jamlab.packing.frame`. None: all
            particles are free.
        walls: whether fixed particles are two rigid walls, see `jamlab.with_walls`: shear along x and compression along
            y shift the upper wall as a whole; the lower wall stays.
        rounding: error of coordinates if their source had fewer digits than float64; else 0.
        provenance: how the packing was made: seed, versions, protocol, wall time, `recipe`.

    Raises:
        InputError: wrong shapes, values that are not finite, a box without area, clockwise polygons. The message names
            the particle and the value.
        SelfCrossingError: the outline of a polygon crosses itself (also an InputError).

    Example:
        >>> p = jamlab.Packing("sp", [[2.0, 0.0], [0.0, 2.0]], [[0.5, 0.5], [1.4, 0.5]], {"k": 1.0}, "k", [1.0, 1.0])
        >>> p
        Packing('sp', n=2, phi=0.392699, units='k', ensemble='fixed-box', converged=False)
        >>> p.n, p.area, round(p.phi, 4)
        (2, 4.0, 0.3927)
        >>> wider = p.with_state(box=1.1 * p.box)  # a copy: packings do not change
        >>> round(wider.phi, 4), wider.converged
        (0.3245, False)
    """

    model: ModelName
    box: Array
    positions: Array
    params: dict[str, Any]
    units: Units = "eps"
    diameters: Array | None = None
    offsets: Indices | None = None
    phi_J: float | None = None
    ensemble: Ensemble = "fixed-box"
    max_force: float | None = None
    converged: bool = False
    provenance: dict[str, Any] = field(default_factory=dict)
    force_tolerance: float | None = None
    on_rattlers: bool = False
    on_target: bool = True
    rounding: float = 0.0
    fixed: Mask | None = None
    walls: bool = False
    _derived: Derived = field(init=False, repr=False)
    if TYPE_CHECKING:  # arrays are made of what is given

        def __init__(
            self,
            model: ModelName,
            box: ArrayLike,
            positions: ArrayLike,
            params: Mapping[str, Any],
            units: Units = "eps",
            diameters: ArrayLike | None = None,
            offsets: Indices | Sequence[int] | None = None,
            phi_J: float | None = None,  # as the field
            ensemble: Ensemble = "fixed-box",
            max_force: float | None = None,
            converged: bool = False,
            provenance: Mapping[str, Any] = ...,
            force_tolerance: float | None = None,
            on_rattlers: bool = False,
            on_target: bool = True,
            rounding: float = 0.0,
            fixed: Mask | Sequence[bool] | None = None,
            walls: bool = False,
        ) -> None: ...

    _measured: ClassVar[Iterable[str]] = MEASURED  # what is hinted at
    _functions: ClassVar[Iterable[str]] = NAMES

    def __post_init__(self) -> None:
        self._set("_derived", Derived())
        check_choice("units", self.units, tuple(MODELS.get(self.model).unit_names))
        self._set("box", finite_array("box", self.box, (2, 2)))
        self._set("positions", finite_array("positions", self.positions, (None, 2)))
        if not len(self.positions):
            raise InputError("a packing needs at least one particle")
        if self.phi_J is not None and not (is_number(self.phi_J) and self.phi_J > 0):
            raise InputError(f"phi_J is {self.phi_J!r}: must be a packing fraction or None")
        self._check_minimum()
        check_box(self.box)
        check_params(self.model, self.units, self.parameters, self.params)
        for name, value in self.kind.checked(self).items():
            self._set(name, value)
        self._set("fixed", checked_fixed(self))
        self._lock()

    def __setstate__(self, state: dict[str, Any]) -> None:
        MODELS.get(state["model"])  # refuses one that is unknown here
        self.__dict__.update(state)
        self._lock()  # pickle drops the flag

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_derived"}

    def _lock(self, derived: Derived | None = None) -> None:
        """Make everything read-only: `converged` would otherwise stay set after a change. `derived`: what has
        been computed of the same state already."""
        self._set("_derived", Derived() if derived is None else derived)
        self._set("params", frozen(self.params))
        self._set("provenance", frozen(self.provenance))
        lock([self.box, self.positions, self.diameters, self.offsets, self.fixed, *self.params.values()])

    def __eq__(self, other: object) -> bool:
        """Whether two packings are the same particles, law, box and positions, to the last digit; not their history."""
        if not isinstance(other, Packing):
            return NotImplemented
        same = np.array_equal(self.box, other.box) and np.array_equal(self.positions, other.positions)
        return same and self.difference(other) is None

    def __hash__(self) -> int:
        return hash((self.model, self.units, self.box.tobytes(), self.positions.tobytes()))

    def __repr__(self) -> str:
        try:
            phi = f"phi={self.phi:.6g}"
        except InputError:  # line tension so strong that there is no free droplet
            phi = "phi=undefined"
        facts = [f"{self.model!r}", f"n={self.n}", phi, f"units={self.units!r}", f"ensemble={self.ensemble!r}"]
        facts += [] if self.phi_J is None else [f"phi_J={self.phi_J:.6g}"]
        facts += [] if self.max_force is None else [f"max_force={self.max_force:.1e}"]
        facts += [f"law={law}"] if (law := self._unusual_law()) else []
        return f"Packing({', '.join(facts)}, converged={self.converged})"

    def _unusual_law(self) -> dict[str, Any]:
        """Parameters of its force law that are not the usual ones: strengths are 1; others are declared with a default,
        or a recipe leaves them out."""
        try:
            recipe = recipe_of(self)
        except InputError:  # of a law that is not installed
            recipe = None
        usual: dict[str, Any] = dict.fromkeys(self.kind.unit_names, 1.0)
        usual |= {name: each.default for name, each in self.parameters.items() if each.default is not None}
        if recipe is not None and recipe.model == self.model and not any("law" in how for _, how in recipe.changes):
            usual = {name: value for name, value in self.params.items() if name not in recipe.parameters} | usual
        scalars = {name: value for name, value in self.params.items() if not self.parameters[name].each}
        return {name: value for name, value in scalars.items() if name not in usual or value != usual[name]}

    def _repr_png_(self) -> bytes | None:
        from jamlab.packing.packing_plot import draw_png

        return draw_png(self)

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _check_minimum(self) -> None:
        for name, value in (("max_force", self.max_force), ("rounding", self.rounding)):
            if value is not None and not (is_number(value) and value >= 0):
                raise InputError(f"{name} is {value!r}: must be 0 or more")

    @property
    def kind(self) -> Model[Packing]:
        """The `Model` (disks or droplets)."""
        return kind_of(self)

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Allowed parameters of the force law."""
        return self.kind.parameters(self.units, self.params)

    @property
    @per_packing
    def law(self) -> PairLaw:
        """The law of its contacts."""
        return self.kind.law(self)

    @property
    def unit_names(self) -> UnitNames:
        """Names of its units, for labels."""
        return self.kind.unit_names[self.units]

    @property
    def n(self) -> int:
        """Number of particles."""
        return len(self.positions) if self.offsets is None else len(self.offsets) - 1

    @property
    def area(self) -> float:
        """Area of the periodic cell."""
        return float(self.box[0, 0] * self.box[1, 1])

    @property
    @per_packing
    def particle(self) -> Indices:
        """(len(positions),) particle that each position belongs to."""
        return self.kind.particle(self)

    @property
    def frame(self) -> Frame[Packing]:
        """What holds it: who is free, which strains it admits, what lies behind flat walls."""
        return frame_of(self)

    @property
    @per_packing
    def flat_walls(self) -> Mask:
        """(n,) which particles are flat walls: fixed lines along x, as particles of one site and of size 0."""
        return np.asarray(self.kind.sizes(self) == 0)

    @property
    def polygons(self) -> Polygons:
        """DP: what is of polygons alone, such as `areas`, `perimeters` and `edges`, without rims; disks have none."""
        return Polygons(self)

    @property
    @per_packing
    def centroids(self) -> Array:
        """(n, 2): centres of the disks, or area centroids of the polygons without rim."""
        return self.kind.centroids(self)

    @property
    def phi(self) -> float:
        """Nominal packing fraction: area of the undeformed particles, overlaps counted twice, over the cell.

        SP: sum(pi d^2/4)/A. DP: sum over particles of the area of the free droplet with its rim. A holds walls as well.
        """
        return self.kind.free_area(self) / self.area

    @property
    def known(self) -> dict[str, Any]:
        """Entries of `KNOWN` that differ from their defaults; files store these."""
        known = {name: value for name, usual in KNOWN.items() if (value := getattr(self, name)) is not usual}
        return {name: value for name, value in known.items() if name == "fixed" or value != KNOWN[name]}

    @checked
    def with_state(self, *, provenance: Mapping[str, Any] | None = None, **changes: Any) -> Packing:
        """Copy with some attributes replaced; `provenance` entries are merged into the old ones.

        A copy with other particles, another box or another force law is at no known minimum: `max_force`, `converged`,
        `force_tolerance`, `on_rattlers` and `on_target` are cleared, unless they are among the changes.
        """
        history = {**self._history(changes), **(provenance or {})}
        copy = replace(self, **self._changed(changes), provenance=history)
        if _DEFINING.isdisjoint(changes):
            copy._set("_derived", self._derived)
        return copy

    def _trusted(self, **changes: Any) -> Packing:
        """`with_state` without checks, of float64 arrays right by construction; `provenance` replaces the old one."""
        changes = {"provenance": self._history(changes), **self._changed(changes)}
        copy = object.__new__(Packing)
        copy.__dict__.update({**self.__dict__, **changes})
        copy._lock(self._derived if _DEFINING.isdisjoint(changes) else None)
        return copy

    def _changed(self, changes: dict[str, Any]) -> dict[str, Any]:
        """Changes of a copy, which is at no known minimum if its state differs."""
        return changes if _STATE.isdisjoint(changes) else {**MINIMUM, **changes}

    def _history(self, changes: Mapping[str, Any]) -> Mapping[str, Any]:
        """Provenance of a copy, which has no recipe if its state differs."""
        if _DEFINING.isdisjoint(changes) or RECIPE not in self.provenance:
            return self.provenance
        return {name: value for name, value in self.provenance.items() if name != RECIPE}

    @checked
    def select(self, particles: Mask) -> Packing:
        """Keep some of the particles. Fewer have another phi, so their packing has no `phi_J`.

        Args:
            particles: (n,) bool, at least one of them True.

        Raises:
            InputError: wrong length, or no particle selected.
        """
        particles = np.asarray(particles)
        if particles.shape != (self.n,) or not particles.any():
            raise InputError(f"particles {particles.shape}: give {self.n} truth values, one or more of them True")
        changes = {"positions": self.positions[particles[self.particle]], **self.kind.selected(self, particles)}
        changes["phi_J"] = self.phi_J if particles.all() else None
        fixed = self.frame.fixed[particles]
        changes |= {"fixed": fixed if fixed.any() else None, "walls": self.walls and bool(fixed.any())}
        own = {name: self.params[name][particles] for name, each in self.parameters.items() if each.each}
        kept = self.kind.sizes(self)[particles & ~self.flat_walls]
        for name in (name for name, each in self.parameters.items() if each.over_size and name in self.params):
            own[name] = self.params[name] * self.frame.sizes.mean() / kept.mean()  # the length stays
        if own:
            changes["params"] = {**self.params, **own}
        return self._trusted(**changes)

    @checked
    def difference(self, other: Packing) -> str | None:
        """Name what, besides box and positions, two packings differ in; None: same particles, same law."""
        for name in ("model", "units", "diameters", "offsets", "fixed", "walls"):
            own, others = getattr(self, name), getattr(other, name)
            if own is not others and not np.array_equal(own, others):
                return name
        for name in sorted(self.params.keys() | other.params.keys()):
            if not np.array_equal(self.params.get(name), other.params.get(name)):  # type: ignore[arg-type]
                return f"params[{name!r}]"
        return None

    @drawn("PolyCollection, such as alpha=1", CELL)
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the particles in their periodic cell: large ones blue, small ones pink; droplets with their rims.

        Where there are more than two sizes, a bar beside the axes says what the colours mean.
        `jamlab.contacts(p).plot(ax)` draws the force network over it.

        >>> ax = jamlab.jam(n=64, seed=1).plot()
        >>> ax.figure.savefig("packing.png")
        """
        from jamlab.packing.packing_plot import add_size_bar, draw_particles, size_colours
        from jamlab.plotting.periodic_cell import frame_cell

        draw_particles(axes, self, size_colours(self), **style)
        frame_cell(axes, self.box)
        add_size_bar(axes, self)

    @property
    def disk_diameters(self) -> Array:
        """SP (n,): diameters; raises for droplets."""
        if self.diameters is None:
            raise InputError("a packing of droplets (model dp) has no diameters: use one of disks")
        return self.diameters
