"""How states of a model are brought to a minimum: the part of its making that relaxation and searches ask."""

from __future__ import annotations

from typing import ClassVar

from jamlab.packing.kinds import MODELS
from jamlab.protocols.descent import Descent, DescentOfBonds
from jamlab.registry import Registry


class Minimising:
    """How states of one model are brought to a minimum.

    Attributes:
        descent: first-order steps, and those to the end.
        settled: largest force that tells a jammed state of a search for onset from a loose one, if that is more than
            the tolerance.
        loose: largest force with which a state near onset, followed by linear response, is judged first; None: it is
            relaxed to the end at once.
        rough: largest force of a state of `compress`, over that at the start of its descent, at which its packing
            fraction is looked at first; None: it is relaxed to the end at once.
    """

    descent: Descent = DescentOfBonds()
    settled: ClassVar[float] = 0.0
    loose: ClassVar[float | None] = None
    rough: ClassVar[float | None] = None


MAKINGS: Registry[Minimising] = Registry("jamlab.makings", "making of the model")


def minimising_of(model: str) -> Minimising:
    """How states of a model are minimised: as its making is registered, else as `Minimising` says."""
    MODELS.get(model)  # refuses one that is unknown
    return MAKINGS.get(model) if model in MAKINGS.names() else Minimising()
