"""Charts of moduli: the static shear modulus, and G*(omega) by every solver."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from jamlab.arguments.choices import ModulusMethod, SpectrumMethod
from jamlab.arrays import Complex
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.estimates.ways import bring_on, default_way
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, modulus_along
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.stiffness import stiffness
from jamlab.packing.packing import Packing
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.protocols.relaxation import relax_session, usual_force_tolerance
from jamlab.protocols.target_pressure import pack
from jamlab.rheology import reduced_model
from jamlab.rheology.complex_modulus import ComplexModulus, complex_modulus
from jamlab.rheology.damping import ContactDamping, StokesDrag
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.equation_of_motion import equation_of_motion
from studies.speed_accuracy.chart import Chart, Panel, Trial

_N, DROPLETS = 64, 8
_PRESSURES = (1e-2, 1e-4)
RHO = 0.92
_FEW, _RHO = 16, (0.87, 0.92, 0.97)
_STRAINS = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
_TOLERANCES = {"sp": (1e-6, 1e-8, 1e-10, 1e-12, 1e-13), "dp": (1e-6, 1e-8, 1e-10, 1e-12)}
_TIGHT = {"sp": (1e-13, 1e-14), "dp": (1e-11, 1e-12)}  # of the packing that the reference is taken from, ten apart
_MOVES = 0.1  # of the pressure: contacts stay


def measure_moduli(seed: int) -> Iterator[Trial]:
    """Measure disks at two pressures, and droplets."""
    for pressure in _PRESSURES:
        packing = pack(_N, pressure, seed, ensemble="shear-stabilized")
        yield from _measure_packing(f"{_N} disks, p = {pressure:g} k", packing, _MOVES * pressure, seed)
    droplets = bring_on(default_way(DROPLETS), jam(DROPLETS, "sp", seed), RHO)
    yield from _measure_packing(f"{DROPLETS} droplets, ρ = {RHO}", droplets, 1e-5, seed)


def measure_droplet_moduli(seed: int) -> Iterator[Trial]:
    """Measure droplets near onset and dense ones."""
    onset = jam(_FEW, "sp", seed)
    for rho in _RHO:
        droplets = bring_on(default_way(_FEW), onset, rho)
        yield from _measure_packing(f"ρ = {rho}", droplets, 1e-5, seed)


def _measure_packing(name: str, packing: Packing, moves: float, seed: int) -> Iterator[Trial]:
    start = packing.with_state(
        positions=packing.positions + moves * np.random.default_rng(seed).standard_normal(packing.positions.shape)
    )
    usual = usual_force_tolerance(packing.model)
    loose, tight = (dense_modulus(relaxed(start, tolerance)) for tolerance in _TIGHT[packing.model])
    panel = Panel(name, tight, max(0.1 * abs(loose / tight - 1), 1e-15), _relative, {"runs": 2, "budget": 0.05})
    for tolerance in _TOLERANCES[packing.model]:
        run = partial(_modulus, start, tolerance)
        yield panel.trial("linear response", f"force {tolerance:g}", run, tolerance == usual)
    yield panel.trial("affine", "", partial(_modulus, start, usual, "affine"))
    first = float(defaults("strain").get(f"strain_step_{packing.model}", defaults("strain")["strain_step"]))
    for strain in sorted({*_STRAINS, first}):
        run = partial(_modulus, start, usual, "finite-strain", strain)
        yield panel.trial("finite strain", f"strain {strain:g}", run)


def _relative(found: float, exact: float) -> float:
    return found / exact - 1


def _modulus(
    start: Packing, force: float, method: ModulusMethod = "linear-response", strain: float | None = None
) -> float:
    return shear_modulus(relaxed(start, force), method, strain_step=strain)


def dense_modulus(packing: Packing) -> float:
    """G, mean over directions, by the pseudo-inverse of the dense Hessian: shares no solver with `elastic_tensor`."""
    network = force_network(packing)
    k = stiffness(network.packing)
    right = k.ue.reshape(-1, 4)
    values, modes = np.linalg.eigh(k.uu.toarray())
    stiff = np.argsort(values)[2:]  # but for the two translations
    response = modes[:, stiff] @ ((modes[:, stiff].T @ right) / values[stiff, None])
    tensor = (k.ee - (response.T @ right).reshape(2, 2, 2, 2)) / packing.area
    return float(modulus_along(tensor, AVERAGING_ANGLES).mean())


def relaxed(start: Packing, tolerance: float | None = None) -> Packing:
    """The minimum that a packing relaxes to."""
    with Session(start) as session:
        relax_session(session, tolerance)
        return session.packing()


_SPECTRUM_SIZES = (64, 256)
_SPECTRUM_PRESSURE = 1e-3
_OMEGA = np.geomspace(1e-8, 1e2, 31)
_SHIFT_TOLERANCES = (1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
_KRYLOV_STEPS = sorted({1, 2, 5, 10, reduced_model.SEARCH.steps})
_REFINEMENTS = 5


def measure_spectra(seed: int) -> Iterator[Trial]:
    """Measure contact damping at one pressure over ten decades of frequency."""
    for n in _SPECTRUM_SIZES:
        yield from measure_spectrum(f"N = {n}", pack(n, _SPECTRUM_PRESSURE, seed), ContactDamping())


def measure_droplets(seed: int) -> Iterator[Trial]:
    """Measure one packing with drag between vertices that touch and with drag of the fluid."""
    droplets = bring_on(default_way(DROPLETS), jam(DROPLETS, "sp", seed), RHO)
    yield from measure_spectrum("contact damping", droplets, ContactDamping())
    yield from measure_spectrum("Stokes drag", droplets, StokesDrag())


def measure_spectrum(name: str, packing: Packing, damping: DragLaw) -> Iterator[Trial]:
    """Measure every solver; nothing if the packing is unstable to shear, as it may be in a fixed box."""
    try:
        chosen = complex_modulus(packing, _OMEGA, damping).method
    except ConvergenceError:
        return
    exact, unsure = refined_modulus(packing, _OMEGA, damping)

    panel = Panel(name, exact, unsure, _off_both, {"runs": 2, "budget": 0.1})
    ways: list[tuple[SpectrumMethod, str, str, dict[str, float]]] = []
    ways += [("dense", "dense", "", {}), ("direct", "direct", "", {})]
    for tolerance in _SHIFT_TOLERANCES:
        ways.append(("reduced", "reduced, tolerance", f"{tolerance:g}", {"tolerance": tolerance, "quiet": 1}))
    for steps in _KRYLOV_STEPS:
        ways.append(("reduced", "reduced, Krylov steps", f"{steps} steps", {"steps": steps}))
    usual = ("", f"{reduced_model.SEARCH.steps} steps")
    for method, way, setting, numbers in ways:
        run = partial(_modulus_with, numbers, packing, damping, method)
        yield panel.trial(way, setting, run, method == chosen and setting in usual)


def _modulus_with(
    numbers: dict[str, float], packing: Packing, damping: DragLaw, method: SpectrumMethod
) -> ComplexModulus:
    """G* with other numbers of the search for shifts."""
    search: Any = numbers
    with patch.object(reduced_model, "SEARCH", replace(reduced_model.SEARCH, **search)):
        return complex_modulus(packing, _OMEGA, damping, method=method)


def _off_both(s: ComplexModulus, exact: Complex) -> float:
    """Largest relative error of G' or G''."""
    return max(float(np.abs(a / b - 1).max()) for a, b in ((s.storage, exact.real), (s.loss, exact.imag)))


def refined_modulus(packing: Packing, omega: NDArray[np.float64], damping: DragLaw) -> tuple[Complex, float]:
    """(m,) G* by a sparse LU for each frequency, refined with residuals and sums of 64-bit mantissa, and its error. The
    error is the error of the equation, r^T r' / A with what the last refinement leaves, and of the last refinement."""
    network = force_network(packing)
    motion = equation_of_motion(network, damping)
    k, b = (m.toarray().astype(np.longdouble) for m in (motion.k_qq, motion.b_qq))
    corner = motion.k_gg, motion.b_gg
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


CHARTS = (
    Chart("shear-modulus", measure_moduli),
    Chart("droplet-modulus", measure_droplet_moduli),
    Chart("spectrum", measure_spectra),
    Chart("droplet-spectrum", measure_droplets),
)
