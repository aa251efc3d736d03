"""Pipkin diagram: Lissajous figures over frequency and amplitude, from linear elastic to flowing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.flow.oscillate import Oscillation
from jamlab.flow.report import describe_balance, say_balance
from jamlab.plotting.drawable import LABEL, drawn, label_axes, merged_line


@dataclass(frozen=True, eq=False)
class Pipkin:
    """Oscillations of one packing at several frequencies and amplitudes.

    >>> found = [jamlab.oscillate(jamlab.pack(n=32, pressure=1e-2, seed=1), 1.0, a, cycles=2) for a in (0.01, 0.1)]
    >>> jamlab.pipkin(found).amplitude
    array([0.01, 0.1 ])

    Attributes:
        oscillations: (m,), in the order given.
    """

    oscillations: tuple[Oscillation, ...]

    @property
    def omega(self) -> Array:
        """(m,) angular frequencies."""
        return np.array([found.omega for found in self.oscillations])

    @property
    def amplitude(self) -> Array:
        """(m,) amplitudes of the strain."""
        return np.array([found.amplitude for found in self.oscillations])

    @property
    def storage(self) -> Array:
        """(m,) G' of the first harmonic."""
        return np.array([found.storage for found in self.oscillations])

    @property
    def loss(self) -> Array:
        """(m,) G'' of the first harmonic."""
        return np.array([found.loss for found in self.oscillations])

    @property
    def imbalance(self) -> float:
        """Largest energy imbalance of all oscillations, see `FlowRun`."""
        return max(found.imbalance for found in self.oscillations)

    def __repr__(self) -> str:
        late = sum(not found.finished for found in self.oscillations)
        words = f"{late} NOT PERIODIC" if late else "all periodic"
        balance = describe_balance(self)
        return f"Pipkin({len(self.oscillations)} oscillations, {len(set(self.omega))} frequencies, {balance}; {words})"

    @drawn("Line2D, of all loops")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw stress over strain of each oscillation, scaled to one size, at its frequency and amplitude.

        Colour says how large the third harmonic is beside the first.

        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> found = [jamlab.oscillate(p, w, a, cycles=2) for w in (1.0, 3.0) for a in (0.01, 0.1)]
        >>> ax = jamlab.pipkin(found).plot()
        """
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        axes.set_xscale("log")
        axes.set_yscale("log")
        width, height = (_spacing(np.log10(values)) for values in (self.omega, self.amplitude))
        shares = [each.third_over_first for each in self.oscillations]
        colours = ScalarMappable(Normalize(0.0, max(*shares, 1e-2)), "viridis")
        for each, share in zip(self.oscillations, shares, strict=True):
            rows = each.last_cycle
            stress = each.stress[rows] - each.stress[rows][1:].mean()
            x = each.omega * 10 ** (0.4 * width * each.strain[rows] / each.amplitude)
            y = each.amplitude * 10 ** (0.4 * height * stress / np.abs(stress).max())
            axes.plot(x, y, **merged_line({"color": colours.to_rgba(np.array(share)), "linewidth": 1.4}, style))
        label_axes(axes, r"angular frequency $\omega\,\tau_1$", r"amplitude $\gamma_0$")
        scale = axes.figure.colorbar(colours, ax=axes)
        scale.set_label(r"third harmonic over first, $|G^*_3|/|G^*_1|$", fontsize=LABEL)
        say_balance(axes, *self.oscillations)


@checked
def pipkin(oscillations: Sequence[Oscillation]) -> Pipkin:
    """Collect oscillations in a diagram.

    >>> found = [jamlab.oscillate(jamlab.pack(n=32, pressure=1e-2, seed=1), w, 0.01, cycles=2) for w in (1.0, 3.0)]
    >>> jamlab.pipkin(found).omega
    array([1., 3.])

    Args:
        oscillations: one or more.

    Raises:
        InputError: none.
    """
    if not len(oscillations):
        raise InputError("a Pipkin diagram needs an oscillation: give results of jamlab.oscillate")
    return Pipkin(tuple(oscillations))


def _spacing(places: Array) -> float:
    """Smallest distance of two different places; 1 if there is one only."""
    steps = np.diff(np.unique(places))
    return float(steps.min()) if len(steps) else 1.0
