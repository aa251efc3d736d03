"""The base class of drag laws: parameters, damping matrix, and the programs that evaluate it.

A law is a frozen dataclass derived from `DragLaw` and an entry of `DRAGS` by its name: those of jamlab (`damping.py`)
and those of other packages. G* needs the matrix alone. `fix overdamped` of the plugin simulates flow in time and knows
one family of laws: `lammps_variables` says which member of it a law is. A law without them is refused there by name.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from jamlab.arguments.choices import Direction
from jamlab.arrays import Array
from jamlab.checks import check_choice, is_number
from jamlab.errors import InputError, typed
from jamlab.mechanics.factors import FLOPPY
from jamlab.mechanics.floppy_modes import PASSES
from jamlab.packing.packing import Packing
from jamlab.packing.shear_direction import shear_direction
from jamlab.packing.terms import ContactJacobian, SparseRows
from jamlab.registry import Registry

if TYPE_CHECKING:
    from scipy import sparse

_KEY = "drag"  # of a declaration in the metadata of a field


@dataclass(frozen=True)
class DragParameter:
    """Declaration of a parameter of a drag law: meaning, range or choices."""

    meaning: str = ""
    least: float = -np.inf
    largest: float = np.inf
    positive: bool = False  # above 0
    choices: tuple[str, ...] = ()
    must: str = ""  # be, in words, where the limits do not say all

    def check(self, name: str, value: Any) -> None:
        """Refuse a value out of range."""
        if self.choices:
            check_choice(name, value, self.choices)
        elif not (is_number(value) and self.least <= value <= self.largest and (value > 0 or not self.positive)):
            given = typed(f"{name} = {value!r}", f"--damping {name}={value}")
            raise InputError(f"{given}: must be {self.must or self._range()}")

    def _range(self) -> str:
        if self.positive:
            return "a positive number"
        if np.isinf(self.largest):
            return "a number" if np.isinf(self.least) else f"a number, {self.least:g} or more"
        return f"a number from {self.least:g} to {self.largest:g}"


def parameter(default: Any, meaning: str = "", **declared: Any) -> Any:
    """A field of a law: its default, its meaning, and more of a `DragParameter`."""
    return field(default=default, metadata={_KEY: DragParameter(meaning, **declared)})


class DragLaw(ABC):
    """A drag law: parameters, damping matrix, and how the plugin evaluates it.

    A subclass is a frozen dataclass of numbers, each declared by `parameter`, with `name` and `matrix`. A subclass that
    writes its own `matrix` does not inherit `power`, `gears` and `on_approach`, which belong to the matrix of its
    parent. No class inherits `name` or `lammps_variables`.

    Example:
        >>> law = jamlab.StokesDrag(eta_f=0.1)
        >>> isinstance(law, jamlab.DragLaw), law.name
        (True, 'stokes')
        >>> law.power(jamlab.pack(n=32, pressure=1e-2, seed=1), np.ones(97)) > 0  # 2 * 32 velocities, 32 spins, a rate
        True
    """

    name: ClassVar[str]  # in DRAGS, files, campaigns and on the command line; by default the name of the class
    at_contacts: bool = True  # whether particles drag on each other where they touch, or on a flow around them
    tau: float = 1.0  # tau_1
    alpha: float = 1.0  # drag grows as this power of the velocity

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.name = cls.__dict__.get("name", cls.__name__)
        others = ["lammps_variables"] + ["power", "gears", "on_approach"] * ("matrix" in cls.__dict__)
        for name in others:
            if name not in cls.__dict__:
                setattr(cls, name, getattr(DragLaw, name))

    def __post_init__(self) -> None:
        for name, declared in self.parameters().items():
            declared.check(name, getattr(self, name))

    @classmethod
    def parameters(cls) -> dict[str, DragParameter]:
        """Declarations of the parameters by name, in order."""
        return {each.name: each.metadata.get(_KEY, DragParameter()) for each in fields(cls)}  # type: ignore[arg-type]

    def __str__(self) -> str:
        numbers = [f"{name} = {value:g}" for name, value in self._numbers().items() if not isinstance(value, str)]
        words = [f"{name} {value}" for name, value in self._numbers().items() if isinstance(value, str)]
        return ", ".join([f"{self.name} drag", *numbers, *words])

    def _numbers(self) -> dict[str, Any]:
        return asdict(self)  # type: ignore[call-overload, no-any-return]

    # analysis ---------------------------------------------------------------------------------------------------------

    @abstractmethod
    def matrix(self, packing: Packing, whole: Packing, direction: Direction) -> sparse.csc_array:
        """Hessian B of the Rayleigh function in the coordinates of `jamlab.dynamical_matrices`.

        Args:
            packing: the packing, perhaps without its rattlers.
            whole: the packing with them, whose mean size is the unit of drag.
            direction: of the shear whose rate comes last.
        """

    def power(self, packing: Packing, rates: Array) -> float:
        """Power that the drag dissipates, q B q.

        Args:
            packing: all of it.
            rates: (size,) q, rates of the coordinates of the matrix; the last one is that of simple shear.
        """
        return float(rates @ (self.matrix(packing, packing, "simple") @ rates))

    @property
    def contrast(self) -> float:
        """Ratio of tangential to normal damping, where drag has such parts."""
        return 1.0

    def linear(self) -> Self:
        """The same law with drag in proportion to the velocity."""
        return self if self.alpha == 1 else replace(self, alpha=1.0)  # type: ignore[type-var]

    def on_approach(self) -> DragLaw | None:
        """The law without its drag on sliding at contacts; None if it has no such part."""
        return None

    def gears(self, packing: Packing, matrix: sparse.csc_array) -> list[int]:
        """One particle of each group that turns without drag, none of them fixed, by the damping matrix."""
        return turns_without_drag(packing, matrix)

    def resists_shear(self, packing: Packing) -> bool:
        """Whether an affine flow dissipates."""
        return bool(self.linear().matrix(packing, packing, "simple")[-1, -1] > 0)

    # flow -------------------------------------------------------------------------------------------------------------

    def lammps_variables(self) -> dict[str, float | str] | None:
        """Variables of `lammps_inputs/parts/flow` by which the plugin carries the law; None: it does not."""
        return None

    # files ------------------------------------------------------------------------------------------------------------

    def record(self) -> dict[str, Any]:
        """Name and numbers, as files keep them, with the package that a law of others comes from."""
        package = type(self).__module__.partition(".")[0]
        origin = {} if package == __name__.partition(".")[0] else {"package": package}
        return {"law": _IN_FILES.get(self.name, self.name), **self._numbers(), **origin}


def _check_law(name: str, law: type[DragLaw]) -> None:
    if not name.isidentifier():
        raise InputError(f"drag law {name!r}: its name must be one word, as it is part of names of columns and options")
    if not (isinstance(law, type) and issubclass(law, DragLaw) and is_dataclass(law)):
        raise InputError(
            f"drag law {name!r}: must be a frozen dataclass under jamlab.rheology.drag_law.DragLaw, not {law!r}"
        )


DRAGS: Registry[type[DragLaw]] = Registry("jamlab.drags", "drag law", _check_law)
_IN_FILES = {"contact": "ContactDamping", "stokes": "StokesDrag"}  # words of files for jamlab's own laws


def law_of_record(record: Mapping[str, Any]) -> DragLaw:
    """Make a law from its `DragLaw.record`."""
    numbers = dict(record)
    word, package = numbers.pop("law"), numbers.pop("package", None)
    name = {there: here for here, there in _IN_FILES.items()}.get(word, word)
    try:
        law = DRAGS.get(name)
    except InputError as error:
        if package is None:
            raise
        raise InputError(f"the drag law {name!r} is of the package {package}: install or import it. {error}") from error
    return law(**numbers)


def make_law(name: str, numbers: Mapping[str, Any]) -> DragLaw:
    """Make a registered law from parameters by name, the others at their defaults."""
    law = DRAGS.get(name)
    declared = law.parameters()
    for each in numbers:
        if each not in declared:
            raise InputError(f"drag law {name!r} has no parameter {each!r}: it has {', '.join(declared) or 'none'}")
    return law(**numbers)


def contact_velocities(
    packing: Packing, direction: Direction, lever_arms: str = "radius"
) -> tuple[sparse.csr_array, sparse.csr_array, Array]:
    """Compute velocities of approach and of sliding at m contacts, as linear functions of the rates of all coordinates.

    Args:
        packing: the packing.
        direction: of the shear whose rate comes last.
        lever_arms: of rotations, "radius" or "contact", see `ContactDamping`; "none": that of centres alone.

    Returns:
        Two sparse (m, size) matrices, of approach and of sliding, and (m,) the stiffness of each contact in drag laws.
    """
    jacobian = _jacobian(packing, direction, lever_arms)
    normal, size = jacobian.normal, jacobian.rolling.size
    columns = np.hstack([2 * jacobian.sites, 2 * jacobian.sites + 1, np.full((len(normal), 1), size - 1)])

    def along(axis: Array) -> sparse.csr_array:
        flow = np.sum(jacobian.flow * axis, axis=1, keepdims=True)
        weights = [jacobian.weights * axis[:, [0]], jacobian.weights * axis[:, [1]], flow]
        return SparseRows(np.hstack(weights), columns, size).matrix()

    slide = along(jacobian.tangent) - (lever_arms != "none") * jacobian.rolling.matrix()
    return along(normal), slide, jacobian.stiffness


def slips(packing: Packing, rates: Array, lever_arms: str = "radius") -> tuple[Array, Array, Array]:
    """(m,) velocities of approach and of sliding at contacts, and their stiffness: those of `contact_velocities` at the
    rates (size,) of all coordinates, the last one of simple shear."""
    jacobian = _jacobian(packing, "simple", lever_arms)
    columns = 2 * jacobian.sites[:, :, None] + np.arange(2)
    velocity = np.einsum("mj,mjk->mk", jacobian.weights, rates[columns]) + rates[-1] * jacobian.flow
    approach, slide = (np.einsum("mk,mk->m", velocity, axis) for axis in (jacobian.normal, jacobian.tangent))
    return approach, slide - (jacobian.rolling @ rates if lever_arms != "none" else 0.0), jacobian.stiffness


def _jacobian(packing: Packing, direction: Direction, lever_arms: str) -> ContactJacobian:
    arms = "radius" if lever_arms == "none" else lever_arms
    return packing.kind.jacobian(packing, arms, shear_direction(packing, direction).generator)


def refuse_slip(packing: Packing, law: DragLaw, background: float = 0.0) -> None:
    """Refuse a packing that slips along flat walls without drag, before a flow."""
    if packing.frame.slips and law.at_contacts and not law.contrast and not background:
        raise InputError(nothing_along_walls(packing, law))


def nothing_along_walls(packing: Packing, law: DragLaw) -> str:
    """Why particles that slip along flat walls without drag have no answer."""
    return (
        f"{law}: nothing drags {packing.kind.particles} along flat walls; use drag on sliding (beta > 0), rough walls "
        "or, in flow, a background drag"
    )


def turns_without_drag(packing: Packing, matrix: sparse.csc_array) -> list[int]:
    """Particles to hold, so that the others cannot turn without drag: as many as the drag on rotations has null
    vectors, which inverse iteration finds."""
    from scipy import sparse
    from scipy.sparse import linalg

    first = 2 * len(packing.positions)
    turning = np.flatnonzero(packing.frame.free[: packing.kind.rotations(packing)])
    diagonal = matrix.diagonal()[first + turning]
    turning, diagonal = turning[diagonal > 0], diagonal[diagonal > 0]
    if not len(turning):
        return []
    scale = sparse.diags_array(1 / np.sqrt(diagonal))
    scaled = sparse.csc_array(scale @ matrix[first + turning][:, first + turning] @ scale)
    count, solver = 1, linalg.splu(scaled + FLOPPY * sparse.eye_array(len(turning), format="csc"))
    while True:
        vectors = np.random.default_rng(1).standard_normal((len(turning), count))
        for _ in range(PASSES):
            vectors = np.linalg.qr(solver.solve(vectors))[0]
        values, turned = np.linalg.eigh(vectors.T @ (scaled @ vectors))
        free = int(np.sum(values < FLOPPY**0.5))
        if free < count or count == len(turning):
            break
        count = min(2 * count, len(turning))
    vectors, held = vectors @ turned[:, :free], list[int]()
    for _ in range(free):  # the one that turns most, and no motion in which it turns is left
        most = int(np.abs(vectors).max(axis=1).argmax())
        held.append(int(turning[most]))
        vectors = np.linalg.qr(vectors @ np.linalg.svd(vectors[[most]])[2][1:].T)[0]
    return held
