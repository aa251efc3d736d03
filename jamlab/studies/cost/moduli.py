"""The shear modulus: linear response at growing force tolerance, finite strain at growing strain, affine."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.estimates.ensemble_way import bring_on, default_way
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, modulus_along
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.stiffness import stiffness
from jamlab.packing.packing import Packing
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
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


def measure(seed: int) -> Iterator[Trial]:
    """Measure disks at two pressures, and droplets."""
    for pressure in _PRESSURES:
        packing = pack(_N, pressure, seed, ensemble="shear-stabilized")
        yield from _measure_packing(f"{_N} disks, p = {pressure:g} k", packing, _MOVES * pressure, seed)
    droplets = bring_on(default_way(_DROPLETS), jam("sp", _DROPLETS, seed), _RHO)
    yield from _measure_packing(f"{_DROPLETS} droplets, ρ = {_RHO}", droplets, 1e-5, seed)


def _measure_packing(panel: str, packing: Packing, moves: float, seed: int) -> Iterator[Trial]:
    """Every method relaxes the same packing, whose sites were moved a little, and finds G, mean over directions."""
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


CHART = Chart(
    "shear-modulus",
    "Static shear modulus, with the minimisation before it",
    "relative error of G",
    "force: tolerance of the minimum, strain: the first one tried, which is halved while contacts change",
    "dense pseudo-inverse of the Hessian of the same packing, relaxed to 1e-14 (droplets 1e-12); its error is a tenth "
    "of what changes from ten times that force",
    measure,
)
