"""Swap Monte Carlo of disks: neighbors exchange their sizes, which finds minima that no motion of theirs would reach.

A glass of many sizes relaxes by moves that no particle can make, at temperatures where its motion has long stopped (A.
Ninarello, L. Berthier and D. Coslovich, Phys. Rev. X 7, 021039 (2017)). Quenched from there, jammed packings are denser
at onset and stiffer than others of the same sizes.
"""

from __future__ import annotations

import ctypes
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.natural_units import mean_size, natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import changed
from jamlab.processes.progress import Progress, told
from jamlab.protocols.relaxation import check_tolerance
from jamlab.protocols.thermal_history import (
    STRETCHES,
    Temperature,
    ThermalHistory,
    check_temperature,
    contact_energy,
    quenched,
    temperatures,
)

SWAP_PROTOCOL = 1  # version, see jamlab.campaign.tasks
# longest move of a disk, over the overlap of two that has the energy k_B T: a quarter to a third succeed; and at most,
# mean diameters
_MOVE, _LONGEST = 2.0, 0.5
_AT_ONCE = 2_000_000  # trials between two looks at interrupts, about a second

_POINTER: Any = ctypes.c_void_p
_swap_disks = kernel(
    "swap_disks",
    *(INTEGER, REALS, REALS, INTEGERS, REALS, INTEGER, REALS, REAL, INTEGER, REAL, REAL, REAL, REAL, INTEGER),
    *(_POINTER, _POINTER, INTEGERS, REALS),
)


@dataclass(frozen=True, eq=False)
class SwapHistory(ThermalHistory):
    """What `swap_sizes` returns.

    Attributes:
        packing, temperature, energy: see `ThermalHistory`.
        sweep: (m,) sweeps until the end of the stretch; in each, every free disk is tried once on average.
        moved: (m,) share of moves that were accepted.
        swapped: (m,) share of swaps that were accepted; swaps of equal sizes are not.
    """

    _rows = ("sweep", "temperature", "energy", "moved", "swapped")
    _along, _along_label = "sweep", "sweeps"

    sweep: Array
    moved: Array
    swapped: Array

    def _said(self) -> str:
        tried = {"moves": self.moved, "swaps": self.swapped}
        means = {name: shares[np.isfinite(shares)] for name, shares in tried.items()}
        return "accepted: " + ", ".join(f"{each.mean():.1%} of {name}" for name, each in means.items() if len(each))


@checked
def swap_sizes(
    packing: Packing,
    temperature: Temperature = (1e-3, 1e-6),
    sweeps: int = 1000,
    *,
    seed: int = 1,
    swap_share: float = 0.2,
    pressure: float | None = None,
    force_tolerance: float | None = None,
    progress: Progress | None = None,
) -> SwapHistory:
    """Anneal disks by swap Monte Carlo, and quench them: an ultrastable packing of the same sizes.

    Trials follow the rule of Metropolis, at constant box: a disk moves, or two exchange their diameters. The diameters
    of the packing are those given in another order, to the last bit.

    Args:
        packing: SP, of disks that repel by a power of their overlap; more than two sizes work best. It may be jammed or
            not.
        temperature: k_B T over the energy of contacts, eps or k d^2; several: from each to the next by equal factors.
        sweeps: number of sweeps, of as many trials as disks that are free.
        seed: of the random numbers.
        swap_share: share of trials that are swaps, 0 to 1.
        pressure: at which the packing is quenched, with a box that is free; default: the box keeps its area.
        force_tolerance: largest residual force, as in `jamlab.relax`.
        progress: called after each stretch with (fraction done, text); True: print it.

    Returns:
        `SwapHistory`: the packing, and temperature, energy and accepted shares on the way. The packing has no `phi_J`:
        it jams elsewhere than the one given.

    Raises:
        InputError: droplets, a law that the compiled loop does not have, or an argument out of range.
        ConvergenceError: the pressure was not reached.

    Example:
        >>> p = jamlab.pack(n=64, phi=0.9, seed=1, sizes="lognormal:0.2")
        >>> found = jamlab.swap_sizes(p, sweeps=200)
        >>> bool(jamlab.evaluate(found.packing).energy < 0.6 * jamlab.evaluate(p).energy)
        True
        >>> sorted(found.packing.disk_diameters) == sorted(p.disk_diameters)
        True
    """
    given, began = check_temperature(temperature), time.perf_counter()
    _check(packing, force_tolerance, pressure)
    scales = natural_scales(packing)
    disks = MetropolisDisks(scales.to_natural(packing), seed)
    stretches = min(STRETCHES, sweeps)
    ends = np.linspace(0, sweeps, stretches + 1).astype(int)[1:]
    levels, rows, done = temperatures(given, stretches), [], 0
    for heat, end in zip(levels.tolist(), ends.tolist(), strict=True):
        rows.append(disks.run(heat, end - done, swap_share))
        done = end
        if progress is not None:
            told(progress)(done / sweeps, f"energy {rows[-1][0]:.3g}")
    energy, moved, swapped = np.array(rows).T
    entries: dict[str, Any] = {"protocol": "swap_sizes", "protocol_version": SWAP_PROTOCOL, "swap_seed": seed}
    entries |= {"temperature": given.tolist(), "sweeps": sweeps, "swap_share": swap_share}
    hot = scales.from_natural(disks.packing())
    found = quenched(packing, hot, force_tolerance, pressure, began, **entries)
    how = {"temperature": given.tolist(), "sweeps": sweeps, "seed": seed, "swap_share": swap_share}
    found = changed(packing, found, "swap_sizes", **how, pressure=pressure, force_tolerance=force_tolerance)
    return SwapHistory(found, levels, energy, ends, moved, swapped)


def _check(packing: Packing, tolerance: float | None, pressure: float | None) -> None:
    if packing.model != "sp":
        raise InputError(
            f"model {packing.model!r}: sizes are swapped between disks, sp; use jamlab.anneal(packing), which moves "
            f"{packing.kind.particles}"
        )
    if packing.law.kernel_arguments() is None:
        raise InputError(
            f"{packing.law} is not in the compiled loop of swaps, which knows powers of the overlap; use "
            "jamlab.anneal(packing) or jamlab.relax_radii(packing), which take every law of disks"
        )
    packing.kind.check_apart(packing)
    check_tolerance(tolerance, 1e-3)
    if pressure is not None:
        check_number("pressure", pressure, np.inf)


class MetropolisDisks:
    """Disks in natural units on their way through trials at temperatures."""

    def __init__(self, packing: Packing, seed: int) -> None:
        law = packing.law.kernel_arguments()
        assert law is not None  # else refused
        frame = packing.frame
        self._given, self._law, self._energy = packing, law, contact_energy(packing)
        self._disks = ~frame.flat_sites  # flat walls are planes here
        self._positions = packing.positions[self._disks].copy()
        self._diameters = packing.disk_diameters[self._disks].copy()
        self._fixed = frame.fixed[self._disks].astype(np.int64)
        self._planes = np.array(frame.planes)
        self._random = np.random.default_rng(seed)

    def run(self, temperature: float, sweeps: int, swap_share: float) -> tuple[float, float, float]:
        """Take sweeps at a temperature over the energy of contacts. Returns the mean energy a particle, in the same
        unit, and the shares of moves and of swaps that were accepted, nan where there were none."""
        n, unit, flat = len(self._positions), self._energy, int(self._given.frame.is_flat)
        move = min(_MOVE * self._given.law.root_energy(temperature), _LONGEST) * mean_size(self._given)
        source, total, energy = self._random.bit_generator.ctypes, np.zeros(4, dtype=np.int64), 0.0
        most = max(1, _AT_ONCE // n)
        for done in range(0, sweeps, most):
            now = min(most, sweeps - done)
            counts, energies = np.zeros(4, dtype=np.int64), np.zeros(now + 1)
            refused = _swap_disks(
                *(n, self._positions, self._diameters, self._fixed, self._given.box, flat, self._planes),
                *(*self._law, temperature * unit, move, swap_share, now),
                *(ctypes.cast(source.next_double, _POINTER), source.state_address, counts, energies),
            )
            if refused:
                raise InputError(
                    f"swap_sizes of {n} disks in the box {self._given.box.tolist()}: more images than can be listed; "
                    "use a box less sheared, or positions nearer to it"
                )
            total, energy = total + counts, energy + float(energies[1:].sum())
        moved, swapped = (float(done / tried) if tried else float("nan") for tried, done in (total[:2], total[2:]))
        return energy / (sweeps * unit * n), moved, swapped

    def packing(self) -> Packing:
        """The state reached."""
        positions, diameters = self._given.positions.copy(), self._given.disk_diameters.copy()
        positions[self._disks], diameters[self._disks] = self._positions, self._diameters
        return self._given._trusted(positions=positions, diameters=diameters)
