"""Studies of disks at and above onset that any code of jamming shows: moduli, vibrations, contacts, protocols.

Units are those of `jam`: energy eps, length the mean diameter; vibrations have masses 1.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, compression_modulus, elastic_tensor, modulus_along
from jamlab.mechanics.held_motions import held_conditions
from jamlab.mechanics.stiffness import hessian, stress
from jamlab.packing.neighbors import periodic_pairs
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from jamlab.protocols.target_pressure import pack
from jamlab.studies.study import TableStudy
from jamlab.studies.table import Row, Task

SIZE = 512  # disks
FREQUENCIES = np.geomspace(1e-3, 10**0.6, 37)  # edges, ten in a decade; lower modes count in the first bin
FORCES = np.geomspace(1e-5, 10.0, 61)  # edges, ten in a decade, over the mean force
GAPS = np.geomspace(1e-7, 1.0, 71)  # over the sum of the radii
BUCKLED = 3  # contacts of a buckler in the plane
DISTANCES = np.geomspace(1e-4, 0.1, 7)  # from onset in phi


def _pressure(packing: Packing) -> float:
    return float(0.5 * np.trace(stress(packing)))


def above_onset(seed: int) -> Iterator[Row]:
    """Measure p, z, B, G and the numbers of modes by frequency of one packing at `DISTANCES` from its onset."""
    onset = jam(n=SIZE, seed=seed)
    for distance, state in zip(DISTANCES, compress(onset, onset.phi + 0.1, 0.1, by="phi", nearest=1e-4, per_decade=2)):
        network = contacts(state)
        row: dict[str, Any] = {"seed": seed, "distance": float(distance), "pressure": _pressure(state)}
        if not network.backbone:
            yield row | {"note": "came loose"}
            continue
        row["excess"] = 2 * (network.count - network.isostatic) / network.backbone
        try:
            c = elastic_tensor(state).relaxed
        except ConvergenceError as error:
            yield row | {"note": str(error)}
            continue
        row |= {"g": float(modulus_along(c, AVERAGING_ANGLES).mean()), "b": compression_modulus(c, row["pressure"])}
        held = np.repeat(~network.rattlers, 2)
        for prestress in (False, True):
            matrix = hessian(state, prestress=prestress).toarray()[np.ix_(held, held)]
            found = np.sqrt(np.maximum(np.linalg.eigvalsh(matrix)[2:], 0.0))
            counts = np.histogram(np.maximum(found, FREQUENCIES[0]), FREQUENCIES)[0]
            yield row | {"prestress": prestress} | {f"modes_{k}": int(m) for k, m in enumerate(counts)}


def at_onset(seed: int) -> Iterator[Row]:
    """Count contacts by force, with and without those of bucklers, and gaps between disks that bear load."""
    onset = jam(n=SIZE, seed=seed)
    network = contacts(onset)
    rows, _, _ = held_conditions(onset)
    force = np.abs(np.linalg.eigh(rows @ rows.T)[1][:, 0])  # the state of self-stress
    pairs = network.pairs[network.bearing]
    degree = np.bincount(pairs.ravel(), minlength=onset.n)
    buckled = (degree[pairs] == BUCKLED).any(axis=1)
    near = periodic_pairs(onset.positions, onset.box, 2.0 * onset.diameters.max())
    kept = ~network.rattlers[near.i] & ~network.rattlers[near.j]
    radii = 0.5 * (onset.diameters[near.i] + onset.diameters[near.j])[kept]
    gap = np.hypot(*near.r[kept].T) / radii - 1
    who = {"seed": seed, "beyond": network.count - network.isostatic, "disks": network.backbone}
    parts = (("bucklers", force[buckled], FORCES), ("others", force[~buckled], FORCES), ("gaps", gap[gap > GAPS[0]], GAPS))
    for what, values, edges in parts:
        scale = 1.0 if what == "gaps" else float(force.mean())
        counts = np.histogram(np.maximum(values / scale, edges[0]), edges)[0]
        yield who | {"what": what} | {f"count_{k}": int(m) for k, m in enumerate(counts)}


_SLOPE = 0.4  # of the pressure in phi near onset, about: a first guess
_LOWEST = 1e-6  # pressure from which onset is extrapolated, by less than 1e-5


def unjamming_fraction(packing: Packing) -> float:
    """Decompress a packing until its pressure is gone; the packing fraction where it is, by a secant."""
    pressure, slope = _pressure(packing), _SLOPE
    jammed, loose = packing, 0.0
    while pressure > _LOWEST:
        aim = max(jammed.phi - 0.9 * pressure / slope, 0.5 * (jammed.phi + loose))
        (state,) = compress(jammed, aim, 1.0, by="phi")
        left = _pressure(state)
        if left < 0.01 * _LOWEST or contacts(state).rattlers.all():  # came loose at once
            loose = aim
            if jammed.phi - loose < _LOWEST:
                return jammed.phi
            continue
        if left < pressure:
            slope = (pressure - left) / (jammed.phi - state.phi)
        jammed, pressure = state, left
    return jammed.phi - pressure / slope


AMPLITUDES = (0.01, 0.03, 0.1)  # of cycles, in phi above the first onset
CYCLES = 8
STEPS = (1e-2, 1e-3, 2e-4)  # of the search for onset; it takes no more than 2e-3 above phi = 0.70
QUENCHED = (1e-3, 1e-2, 5e-2)  # pressures of packings that were quenched above onset
CYCLED = 256  # disks


def by_steps(seed: int) -> Iterator[Row]:
    """Find the onset of one random start by compression in steps, and of quenches above onset by decompression."""
    for step in STEPS:
        yield {"seed": seed, "way": "steps", "setting": f"{step:g}", "phi_J": jam(n=CYCLED, seed=seed, step=step).phi}
    for pressure in QUENCHED:
        found = unjamming_fraction(pack(CYCLED, pressure, seed))
        yield {"seed": seed, "way": "quench", "setting": f"{pressure:g}", "phi_J": found}


def by_cycles(seed: int) -> Iterator[Row]:
    """Compress and decompress one packing again and again, by `AMPLITUDES` above its first onset."""
    first = jam(n=CYCLED, seed=seed)
    for amplitude in AMPLITUDES:
        state = first
        for cycle in range(1, CYCLES + 1):
            *_, dense = compress(state, first.phi + amplitude, 0.01, by="phi")
            phi = unjamming_fraction(dense)
            if cycle & (cycle - 1) == 0:
                yield {"seed": seed, "way": "cycles", "setting": f"{amplitude:g}", "cycle": cycle, "phi_J": phi}
            (state,) = compress(dense, phi + 1e-5, 1.0, by="phi")


@dataclass(frozen=True)
class OfPackings(TableStudy):
    """A study whose tasks are packings of the seeds from 1 on, each measured by one function."""

    task: ClassVar[str] = "packing"
    kind: ClassVar[str] = "jamming"
    measure: Callable[[int], Iterable[Row]]
    seeds: int

    def tasks(self) -> Mapping[str, Task]:
        """One packing each."""
        return {f"{seed}": partial(self.measure, seed) for seed in range(1, self.seeds + 1)}


class Elasticity(OfPackings):
    def show(self, table):
        raise NotImplementedError

    """Pressure, moduli and vibrations over the distance from onset."""

    columns: ClassVar = (
        *("seed", "distance", "pressure", "excess", "g", "b", "prestress"),
        *(f"modes_{k}" for k in range(len(FREQUENCIES) - 1)),
        "note",
    )


class Onset(OfPackings):
    def show(self, table):
        raise NotImplementedError

    """Small forces and gaps at onset."""

    columns: ClassVar = ("seed", "beyond", "disks", "what", *(f"count_{k}" for k in range(len(GAPS) - 1)))


class Protocols(OfPackings):
    def show(self, table):
        raise NotImplementedError

    """Onset by way of preparation."""

    columns: ClassVar = ("seed", "way", "setting", "cycle", "phi_J")


ELASTICITY = Elasticity("jamming-moduli", "Pressure, moduli and vibrations above onset", above_onset, 40)
ONSET = Onset("jamming-forces", "Small forces and gaps at onset", at_onset, 100)
STEPS_OF = Protocols("jamming-protocols", "Onset by way of preparation", by_steps, 24)
CYCLES_OF = Protocols("jamming-cycles", "Onset after cycles of compression", by_cycles, 24)
