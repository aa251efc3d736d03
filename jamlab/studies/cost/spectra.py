"""Charts of G*(omega) of disks and droplets by three solvers, the reduced one along its tolerance and Krylov steps."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from jamlab.arrays import Complex
from jamlab.errors import ConvergenceError
from jamlab.estimates.ensemble_way import bring_on, default_way
from jamlab.mechanics.force_network import force_network
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.rheology.equation_of_motion import equation_of_motion
from jamlab.rheology.reduced_model import SETTINGS
from jamlab.studies.cost.chart import Chart, Trial
from jamlab.studies.table import shortest

_SIZES = (64, 256)
_PRESSURE = 1e-3
_DROPLETS, _RHO = 8, 0.92
_OMEGA = np.geomspace(1e-8, 1e2, 31)
_TOLERANCES = (1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
_STEPS = (1, 2, 5, 10)
_REFINEMENTS = 5


def measure(seed: int) -> Iterator[Trial]:
    """Measure contact damping at one pressure over ten decades of frequency."""
    for n in _SIZES:
        yield from measure_packing(f"N = {n}", pack(n, _PRESSURE, seed), ContactDamping())


def measure_droplets(seed: int) -> Iterator[Trial]:
    """Measure one packing with drag between vertices that touch and with drag of the fluid."""
    droplets = bring_on(default_way(_DROPLETS), jam("sp", _DROPLETS, seed), _RHO)
    yield from measure_packing("contact damping", droplets, ContactDamping())
    yield from measure_packing("Stokes drag", droplets, StokesDrag())


def measure_packing(panel: str, packing: Packing, damping: Damping) -> Iterator[Trial]:
    """Measure every solver; nothing if the packing is unstable to shear, as it may be in a fixed box."""
    try:
        chosen = complex_modulus(packing, _OMEGA, damping).method
    except ConvergenceError:
        return
    exact, unsure = refined_modulus(packing, _OMEGA, damping)
    ways = [("dense", "dense", "", SETTINGS), ("direct", "direct", "", SETTINGS)]
    for tolerance in _TOLERANCES:
        ways.append(
            ("reduced", "reduced, tolerance", f"{tolerance:g}", replace(SETTINGS, tolerance=tolerance, quiet=1))
        )
    for steps in _STEPS:
        ways.append(("reduced", "reduced, Krylov steps", f"{steps} steps", replace(SETTINGS, steps=steps)))
    for method, name, setting, settings in ways:
        try:
            run = partial(complex_modulus, packing, _OMEGA, damping, method=method, settings=settings)
            seconds, s = shortest(run, runs=2, budget=0.1)
        except ConvergenceError as error:
            yield Trial(panel, name, setting, float("nan"), float("nan"), unsure, note=str(error))
            continue
        parts = ((s.storage, exact.real), (s.loss, exact.imag))
        off = max(float(np.abs(a / b - 1).max()) for a, b in parts)
        default = method == chosen and setting in ("", f"{SETTINGS.steps} steps")
        yield Trial(panel, name, setting, seconds, off, unsure, default)


def refined_modulus(packing: Packing, omega: NDArray[np.float64], damping: Damping) -> tuple[Complex, float]:
    """(m,) G* by a sparse LU for each frequency, refined with residuals and sums of 64-bit mantissa, and its error. The
    error is that of the equation, r^T r' / A with what the last refinement leaves, and of the last refinement."""
    network = force_network(packing)
    motion = equation_of_motion(network, damping)
    k, b = (m.toarray().astype(np.longdouble) for m in (motion.k_qq, motion.b_qq))
    corner = motion.k[-1, -1], motion.b[-1, -1]
    values, unsure = [], 0.0
    for w in omega:
        column = motion.k_qg.astype(np.longdouble) + 1j * np.longdouble(w) * motion.b_qg
        matrix = k + 1j * np.longdouble(w) * b
        solver = splu((motion.k_qq + 1j * w * motion.b_qq).tocsc())
        q = np.zeros_like(column)
        modulus = []
        for _ in range(_REFINEMENTS):
            q = q + solver.solve((-column - matrix @ q).astype(np.complex128))
            modulus.append((corner[0] + 1j * np.longdouble(w) * corner[1] + column @ q) / motion.area)
        last, before = modulus[-1], modulus[-2]
        gaps = (abs(part(last) - part(before)) / abs(part(last)) for part in (np.real, np.imag))
        unsure = max(unsure, 1e-17, *map(float, gaps))
        values.append(complex(last))
    return np.array(values), unsure


DISKS = Chart(
    "spectrum",
    "Complex shear modulus at 31 frequencies over ten decades",
    "largest relative error of G' or G''",
    "tolerance at which shifts end, one quiet update; or Krylov steps at a shift",
    "a sparse factorisation for each frequency, refined with numbers of 64 bits of mantissa until it stands",
    measure,
)
DROPLETS = replace(
    DISKS,
    name="droplet-spectrum",
    title=f"Complex shear modulus of {_DROPLETS} droplets at ρ = {_RHO}, 31 frequencies over ten decades",
    measure=measure_droplets,
)
