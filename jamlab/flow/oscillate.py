"""Shear a packing to and fro until its answer repeats."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.flow.at_rest import check_touching
from jamlab.flow.flow_run import Progress
from jamlab.flow.oscillation import HARMONICS, Complex, Oscillation, fit_harmonics
from jamlab.flow.recording import Recording
from jamlab.flow.run_file import RunFile
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import ContactDamping, Damping

TOLERANCE = 1e-3  # a modulus is wanted better than a stress in flow
POINTS = 32  # rows in a cycle: about as many as there are steps at high frequencies
MOST_CYCLES = 10_000
LARGEST_AMPLITUDE = 2.0  # beyond, every half cycle is steady flow
_SLOWEST, _FASTEST = 1e-8, 1e3


@checked
def oscillate(
    packing: Packing,
    omega: float,
    amplitude: float,
    damping: Damping | None = None,
    *,
    cycles: int = 20,
    points: int = POINTS,
    tolerance: float = TOLERANCE,
    background: float = 0.0,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> Oscillation:
    """Shear a packing by amplitude sin(omega t) along x of the box, without inertia, until the stress repeats.

    Of a small amplitude, storage and loss are those of `complex_modulus`, if no contact opens or closes: near onset
    that takes amplitudes well below pressure over stiffness, and rattlers that just touch, which
    `complex_modulus` leaves out, drag at any amplitude.

    >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
    >>> o, s = jamlab.oscillate(p, omega=1.0, amplitude=1e-6), jamlab.complex_modulus(p, [1.0])
    >>> bool(abs(o.storage - s.storage[0]) < 2e-3 * s.storage[0])
    True

    Args:
        packing: SP or DP at a minimum.
        omega: angular frequency, 1/tau_1, from 1e-8 to 1e3.
        amplitude: of the strain, up to 2.
        damping: see `shear`.
        cycles: at most; two at least. It ends when the first harmonic changes by less than the tolerance.
        points: rows in a cycle, at least 16.
        tolerance: see `shear`.
        background: see `shear`.
        out: see `shear`.
        progress: called after each cycle.

    Raises:
        InputError: particles that do not touch, or a value out of range.
        ConvergenceError: see `shear`.
        StorageError: `out` cannot be written.
    """
    law = damping or ContactDamping()
    if not _SLOWEST <= omega <= _FASTEST:
        raise InputError(f"omega = {omega!r}: must lie between {_SLOWEST:g} and {_FASTEST:g}, in 1/tau_1")
    check_number("amplitude", amplitude, LARGEST_AMPLITUDE)
    if not 2 <= cycles <= MOST_CYCLES:
        raise InputError(f"cycles = {cycles}: must lie between 2, which are compared, and {MOST_CYCLES}")
    if not 2 * HARMONICS + 2 <= points <= 100_000:
        raise InputError(f"points = {points}: must lie between {2 * HARMONICS + 2} and 100000 in a cycle")
    check_touching(packing)
    task = {"omega": omega, "amplitude": amplitude, "points": points, "tolerance": tolerance, "background": background}
    file = RunFile(out, Oscillation, packing, law, task)
    found = list(file.before.cycle_harmonics) if file.before else []
    with Recording(packing, law, tolerance, background, file.before) as flow:

        def result() -> Oscillation:
            answer = {"cycle_harmonics": np.array(found), "converged": _repeats(found, tolerance)}
            return Oscillation(**flow.content() | answer, omega=omega, amplitude=amplitude, points=points)

        flow.drive(f"oscillate {amplitude:.17g} {omega:.17g}", 2 * np.pi / omega / points)
        while len(found) < cycles and not _repeats(found, tolerance):
            rows = [flow.advance() for _ in range(points)]
            time, stress = (np.array([getattr(row, name) for row in rows]) for name in ("time", "stress"))
            found.append(fit_harmonics(time, stress, omega, amplitude))
            file.save(result)
            if progress is not None:
                progress(f"cycle {len(found)}", len(found) / cycles)
        last = result()
    file.save(lambda: last, now=True)
    return last


def _repeats(found: list[Complex], tolerance: float) -> bool:
    return len(found) > 1 and bool(abs(found[-1][0] - found[-2][0]) <= tolerance * abs(found[-1][0]))
