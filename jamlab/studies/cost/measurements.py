"""Charts of what is measured of a packing: its shear modulus by finite strain, and its true packing fraction."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.estimates.ensemble_way import bring_on, default_way
from jamlab.geometry.packing_fraction import METHODS, packing_fraction
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, modulus_along
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.stiffness import stiffness
from jamlab.packing.packing import Packing
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.protocols.target_pressure import pack
from jamlab.studies.cost.chart import Chart, Trial
from jamlab.studies.table import shortest

_N, _DROPLETS = 64, 8
_PRESSURES = (1e-2, 1e-4)
_RHO = 0.92
_STRAINS = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
_TOLERANCES = {"sp": (1e-6, 1e-8, 1e-10, 1e-12, 1e-13), "dp": (1e-6, 1e-8, 1e-10, 1e-12)}
_TIGHT = {"sp": (1e-13, 1e-14), "dp": (1e-11, 1e-12)}  # of the packing that the reference is taken from, ten apart
_MOVES = 0.1  # of the pressure: contacts stay


def measure_moduli(seed: int) -> Iterator[Trial]:
    """Measure disks at two pressures, and droplets."""
    for pressure in _PRESSURES:
        packing = pack(_N, pressure, seed, ensemble="shear-stabilized")
        yield from _measure_packing(f"{_N} disks, p = {pressure:g} k", packing, _MOVES * pressure, seed)
    droplets = bring_on(default_way(_DROPLETS), jam("sp", _DROPLETS, seed), _RHO)
    yield from _measure_packing(f"{_DROPLETS} droplets, ρ = {_RHO}", droplets, 1e-5, seed)


def _measure_packing(panel: str, packing: Packing, moves: float, seed: int) -> Iterator[Trial]:
    start = packing.with_state(
        positions=packing.positions + moves * np.random.default_rng(seed).standard_normal(packing.positions.shape)
    )
    usual = force_tolerance(packing.model)
    loose, tight = (dense_modulus(_relax(start, tolerance)) for tolerance in _TIGHT[packing.model])
    unsure = max(0.1 * abs(loose / tight - 1), 1e-15)
    ways: list[tuple[str, str, bool, Callable[[], float]]] = []
    for tolerance in _TOLERANCES[packing.model]:
        ways.append(
            ("linear response", f"force {tolerance:g}", tolerance == usual, partial(_modulus, start, tolerance))
        )
    ways.append(("affine", "", False, partial(_modulus, start, usual, "affine")))
    first = float(defaults("strain")["strain" if packing.model == "sp" else "strain_droplets"])
    for strain in sorted({*_STRAINS, first}):
        ways.append(
            ("finite strain", f"strain {strain:g}", False, partial(_modulus, start, usual, "finite-strain", strain))
        )
    for method, setting, default, run in ways:
        try:
            seconds, g = shortest(run, runs=2, budget=0.05)
        except ConvergenceError as error:
            yield Trial(panel, method, setting, float("nan"), float("nan"), unsure, default, str(error))
            continue
        yield Trial(panel, method, setting, seconds, g / tight - 1, unsure, default)


def _modulus(start: Packing, force: float, method: str = "linear-response", strain: float | None = None) -> float:
    return float(shear_modulus(_relax(start, force), method, average=True, strain=strain))


def dense_modulus(packing: Packing) -> float:
    """G, mean over directions, by the pseudo-inverse of the dense Hessian: shares no solver with `elastic_tensor`."""
    network = force_network(packing)
    k = stiffness(network.packing, network.terms)
    right = k.ue.reshape(-1, 4)
    values, modes = np.linalg.eigh(k.uu.toarray())
    stiff = np.argsort(values)[2:]  # but for the two translations
    response = modes[:, stiff] @ ((modes[:, stiff].T @ right) / values[stiff, None])
    tensor = (k.ee - (response.T @ right).reshape(2, 2, 2, 2)) / packing.area
    return float(modulus_along(tensor, AVERAGING_ANGLES).mean())


def _relax(start: Packing, tolerance: float) -> Packing:
    with Session(start) as session:
        relax(session, tolerance)
        return session.packing()


SHEAR_MODULUS = Chart(
    "shear-modulus",
    "Static shear modulus, with the minimisation before it",
    "relative error of G",
    "force: tolerance of the minimum, strain: the first one tried, which is halved while contacts change",
    "dense pseudo-inverse of the Hessian of the same packing, relaxed to 1e-14 (droplets 1e-12); its error is a tenth "
    "of what changes from ten times that force",
    measure_moduli,
)


_PHI = (0.86, 1.0, 1.2)
_DISKS = 64
_COUNTS = (100, 1000, 10_000, 100_000)  # random points
_ROUNDING = 1e-15  # of areas of order 1: what the two exact ways, which share no step, differ by at most


def measure_fractions(seed: int) -> Iterator[Trial]:
    """Measure all methods on one packing at three phi, against 1 minus the voids, which needs no overlap areas."""
    for phi in _PHI:
        packing = _relax_disks(seed, phi)
        reference = 1.0 - float(voids(packing).area.sum()) / packing.area
        panel = f"φ = {phi:g}"
        for method in METHODS["sp"]:
            seconds, rho = shortest(lambda p=packing, m=method: packing_fraction(p, m), runs=5, budget=0.1)  # type: ignore[misc]
            yield Trial(panel, method, "", seconds, rho - reference, _ROUNDING, method == "exact")
        for count in _COUNTS:
            seconds, rho = shortest(lambda p=packing, c=count: covered(p, c, seed), runs=3, budget=0.1)  # type: ignore[misc]
            yield Trial(panel, "random points", f"{count}", seconds, rho - reference, _ROUNDING)


def covered(packing: Packing, count: int, seed: int) -> float:
    """Share of random points that lie inside a disk, in a box with right angles: error sqrt(rho (1 - rho)/count)."""
    assert packing.diameters is not None
    sides = packing.box.diagonal()
    points = np.random.default_rng(seed).uniform(size=(count, 2)) * sides
    inside = np.zeros(count, dtype=bool)
    for centre, diameter in zip(packing.positions, packing.diameters, strict=True):
        apart = points - centre
        apart -= sides * np.round(apart / sides)
        inside |= (apart**2).sum(axis=1) < 0.25 * diameter**2
    return float(inside.mean())


def _relax_disks(seed: int, phi: float) -> Packing:
    with Session(random_disks(_DISKS, seed, phi=phi)) as session:
        relax(session)
        return session.packing()


FRACTIONS = Chart(
    "packing-fraction",
    "True packing fraction of 64 disks",
    "error of ρ",
    "number of random points",
    "1 minus the area of the voids from their exact boundaries, known to rounding, 1e-15",
    measure_fractions,
    reason="exact asks first whether pairs are enough, which costs what pairs saves; pairs alone is wrong elsewhere",
)
