"""Plastic events of quasi-static shear: where they are, and what each one changes.

How many particles take part is the participation number of D2min (Falk & Langer, Phys. Rev. E 57, 7192 (1998)). T1
events are those of `jamlab.motion.t1_events`, by neighbours of the tessellation.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.tessellation import tessellation
from jamlab.motion.local_strain import local_strain
from jamlab.motion.t1_events import find_swaps
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLUE, GREEN, RED

_COLOURS = {"T1": RED, "contact change": BLUE, "neither": GREEN}


@dataclass(frozen=True, eq=False)
class PlasticEvents(Result):
    """Plastic events: m steps in which stress fell or energy was lost, and which a step back does not undo.

    Attributes:
        strain: (m,) at the end of the step.
        stress_drop: (m,) stress before less that after, along the step; negative where it rose by more than it fell.
        released: (m,) energy lost per area of the cell at the start: the work by the trapezoidal rule less the rise of
            the energy.
        width: (m,) strain of the step: the event lies that much before `strain` at most.
        energy: (m,) energy lost by the whole packing, `released` times that area.
        before, after: m packings each on both sides of the step; none without `event_width`.
        energy_unit: unit of `energy`, for labels.

    Without `event_width`, what follows from packings on both sides is refused.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=3)
        >>> e = jamlab.quasistatic_shear(p, strain=0.03, strain_step=5e-3, event_width=1e-6).events
        >>> len(e), bool(e.width[0] <= 1e-6), e.kind.tolist()
        (1, True, ['contact change'])
        >>> bool(1 <= e.participation[0] <= 32), int(e.contacts_lost[0]), int(e.contacts_gained[0])
        (True, 1, 2)
    """

    _rows = ("strain", "stress_drop", "released", "width", "energy")
    _OF_PACKINGS = (
        "participation",
        "contacts_lost",
        "contacts_gained",
        "neighbors_lost",
        "neighbors_gained",
        "t1",
        "kind",
    )

    strain: Array
    stress_drop: Array
    released: Array
    width: Array
    energy: Array
    before: tuple[Packing, ...] = field(default=(), repr=False)
    after: tuple[Packing, ...] = field(default=(), repr=False)
    energy_unit: str = field(default="", repr=False)

    def __len__(self) -> int:
        return len(self.strain)

    @cached_property
    def participation(self) -> Array:
        """(m,) number of particles that take part, (sum D2min)^2/sum D2min^2, rattlers left out."""
        return np.array([local_strain(*pair).participation for pair in self._pairs()], dtype=np.float64)

    @property
    def contacts_lost(self) -> Indices:
        """(m,) number of force-bearing contacts that open."""
        return np.array([lost for lost, _ in self._contacts], dtype=np.int64)

    @property
    def contacts_gained(self) -> Indices:
        """(m,) number of force-bearing contacts that close."""
        return np.array([gained for _, gained in self._contacts], dtype=np.int64)

    @property
    def neighbors_lost(self) -> Indices:
        """(m,) number of pairs of neighbours of the tessellation that part."""
        return np.array([lost for lost, _, _ in self._neighbors], dtype=np.int64)

    @property
    def neighbors_gained(self) -> Indices:
        """(m,) number of pairs that become neighbours of the tessellation."""
        return np.array([gained for _, gained, _ in self._neighbors], dtype=np.int64)

    @property
    def t1(self) -> Indices:
        """(m,) number of T1 events, see `jamlab.t1_events`."""
        return np.array([swaps for _, _, swaps in self._neighbors], dtype=np.int64)

    @property
    def kind(self) -> NDArray[np.str_]:
        """(m,) "T1"; "contact change" where contacts open or close without a T1 event; "neither"."""
        changes = self.contacts_lost + self.contacts_gained > 0
        return np.where(self.t1 > 0, "T1", np.where(changes, "contact change", "neither"))

    def _pairs(self) -> Iterable[tuple[Packing, Packing]]:
        if len(self.before) != len(self):
            raise InputError(
                "events that are known to a step have no packings on both sides: give "
                "quasistatic_shear(..., event_width=1e-6)"
            )
        return zip(self.before, self.after, strict=True)

    @cached_property
    def _contacts(self) -> list[tuple[int, int]]:
        """Contacts lost and gained; one that bears no force before or after, as of rattlers, does not count."""
        found = []
        for pair in self._pairs():
            every = [_counted(contacts(each).pairs) for each in pair]
            bearing = [bearing_contacts(each) for each in pair]
            found.append(((bearing[0] - every[1]).total(), (bearing[1] - every[0]).total()))
        return found

    @cached_property
    def _neighbors(self) -> list[tuple[int, int, int]]:
        """Pairs of neighbours lost and gained, and T1 events among them."""
        found = []
        for pair in self._pairs():
            old, new = (_counted(np.column_stack([cells.wall_i, cells.wall_j])) for cells in map(tessellation, pair))
            found.append(((old - new).total(), (new - old).total(), len(find_swaps(set(old), set(new)))))
        return found

    def _columns(self) -> dict[str, Any]:
        more = self._OF_PACKINGS if len(self.before) == len(self) else ()
        return {name: getattr(self, name) for name in (*self._rows, *more)}

    @drawn("Line2D of all kinds of events, such as markersize=8")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the energy that each event loses over its strain; colours tell T1 events from changes of contacts.

        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=3)
        >>> ax = jamlab.quasistatic_shear(p, strain=0.03, strain_step=5e-3, event_width=1e-6).events.plot()
        """
        kinds = self.kind if len(self.before) == len(self) else np.full(len(self), "events")
        for name in dict.fromkeys(kinds.tolist()):
            chosen = kinds == name
            look = {"color": _COLOURS.get(name, BLUE), "marker": "o", "markersize": 5, "linestyle": "none"}
            axes.plot(
                self.strain[chosen],
                self.energy[chosen],
                **merged_line(look | {"label": f"{name}: {chosen.sum()}"}, style),
            )
        if (self.energy > 0).any():
            axes.set_yscale("log")
        label_axes(axes, r"strain $\gamma$", in_unit("energy lost", self.energy_unit))
        if len(self):
            axes.legend(fontsize=LEGEND)


def bearing_contacts(packing: Packing) -> Counter[tuple[int, int]]:
    """Pairs of particles whose contact bears force, with how many images of one touch the other."""
    return _counted(contacts(packing).pairs[contacts(packing).bearing])


def _counted(pairs: Indices) -> Counter[tuple[int, int]]:
    """Pairs of particles, with how many images of one touch the other."""
    return Counter(map(tuple, np.sort(pairs, axis=1).tolist()))
