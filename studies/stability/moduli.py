"""Maps where moduli fail: states off their minimum; G* at extreme frequencies."""

from functools import cache

import numpy as np

from jamlab.arguments.choices import SpectrumMethod
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.mechanics.force_network import LARGEST_IMBALANCE
from jamlab.packing.packing import Packing
from jamlab.protocols.moduli import shear_modulus
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.damping import ContactDamping
from studies.stability.map import Map, Trial
from studies.stability.packings import packed
from studies.stability.plain_physics import plain_complex_modulus, plain_shear_modulus

_NEAR = 1e-2  # of the affine modulus: error of a packing almost at its minimum that would show in a plot


def opening_strain(packing: Packing) -> float:
    """Simple shear, one way or the other, at which the static linear answer opens the first contact, or the affine
    motion, which is the answer to a fast shear, if it opens one sooner."""
    found = contacts(packing)
    answer = elastic_tensor(packing).displacements[:, :, 0, 1]
    i, j = found.pairs.T
    assert packing.diameters is not None
    distance = np.hypot(*found.r.T)
    overlap = 0.5 * (packing.diameters[i] + packing.diameters[j]) - distance
    fast = found.r.prod(axis=1) / distance
    slow = fast + np.einsum("mk,mk->m", found.r, answer[j] - answer[i]) / distance
    return float(np.min(overlap / np.maximum(np.maximum(np.abs(slow), np.abs(fast)), 1e-300)))


_plain_modulus = cache(plain_shear_modulus)


def try_moved(packing: Packing, seed: int, distance: float) -> Trial:
    """G by linear response where disks were moved off their minimum at random, the farthest by a distance."""
    moves = np.random.default_rng(seed).standard_normal(packing.positions.shape)
    moved = packing.with_state(positions=packing.positions + distance * (moves / np.hypot(*moves.T).max()))
    found, affine = shear_modulus(moved, direction="simple"), shear_modulus(packing, "affine", direction="simple")
    return Trial("converged", f"G = {found:.3g}", abs(found - _plain_modulus(packing)) / affine, _NEAR)


_GOOD = 1e-4  # relative error of G' or G'' beyond which a result counts as failed: it would show in a plot or a fit
_ESTIMATE = 10.0  # by which an error may exceed the estimate of the solver
_METHODS: tuple[SpectrumMethod, ...] = ("dense", "direct", "reduced")  # seeds take one after the other
_N = 12


_plain = cache(plain_complex_modulus)


def try_spectrum(omega: float, pressure: float, seed: int) -> Trial:
    """One solver at one frequency, judged by its own estimate."""
    index, way = divmod(seed - 1, len(_METHODS))
    packing, method = packed(_N, pressure, index + 1), _METHODS[way]
    s = complex_modulus(packing, [omega], ContactDamping(), method=method)
    estimate = float(s.error_bound[0])
    if not estimate < _GOOD:
        return Trial("stalled", f"{method}: says that its error is {estimate:.1g}")
    plain = _plain(packing, omega)
    error = max(abs(s.storage[0] / plain.real - 1), abs(s.loss[0] / plain.imag - 1))
    return Trial("converged", f"{method}: error {error:.1g}", error, max(_GOOD, _ESTIMATE * estimate))


MAPS = (
    Map(
        "moved",
        lambda distance, p, seed: try_moved(packed(16, p, seed), seed, distance),
        # where the largest force is 1 % of the pressure times the diameter: stiffness is 1
        lambda p, seed: LARGEST_IMBALANCE * float(packed(16, p, seed).provenance["pressure"]),
    ),
    Map("spectrum-frequency", try_spectrum),
)
