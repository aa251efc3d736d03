"""Load a packing at rest with a shear stress, and follow its strain."""

from __future__ import annotations

from pathlib import Path

from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.flow.at_rest import check_touching
from jamlab.flow.creep_run import CreepRun
from jamlab.flow.flow_run import Progress
from jamlab.flow.recording import Recording
from jamlab.flow.run_file import RunFile
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag

TOLERANCE = 1e-3
LARGEST_STRESS, LONGEST = 1e3, 1e12


@checked
def creep(
    packing: Packing,
    stress: float,
    duration: float,
    damping: Damping | None = None,
    *,
    largest_strain: float = 10.0,
    tolerance: float = TOLERANCE,
    background: float = 0.0,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> CreepRun:
    """Add a shear stress to that of a packing at rest, and hold it; without inertia.

    The rate of shear is one more unknown of the force balance: b u + c rate = A (stress - elastic stress), with b and c
    the last row of `dynamical_matrices`' B; of Stokes drag b = 0 and c = A eta_F. Rows lie evenly in the logarithm of
    time.

    >>> k = jamlab.creep(jamlab.pack(n=32, pressure=1e-2, seed=1), stress=1e-7, duration=10.0)
    >>> bool(np.all(np.diff(k.compliance) > 0))
    True

    Args:
        packing: SP or DP at a minimum.
        stress: added to the residual stress of the packing, in its unit; positive.
        duration: time, tau_1.
        damping: `ContactDamping` (default, beta = 1), linear or a power law, or `StokesDrag` with eta_f > 0.
        largest_strain: at which it ends early: under a stress above yield a packing flows for ever.
        tolerance: see `shear`.
        background: see `shear`.
        out: see `shear`.
        progress: called after each row.

    Raises:
        InputError: particles that do not touch, a fluid without viscosity, or a value out of range.
        ConvergenceError: see `shear`.
        StorageError: `out` cannot be written.
    """
    law = damping or ContactDamping()
    if isinstance(law, StokesDrag) and law.eta_f == 0:
        raise InputError(
            f"{law}: nothing holds the affine flow against a stress, and its rate has no limit; give eta_f > 0, or "
            "use contact damping"
        )
    check_number("stress", stress, LARGEST_STRESS)
    check_number("duration", duration, LONGEST)
    check_number("largest_strain", largest_strain, 1e4)
    check_touching(packing)
    file = RunFile(out, CreepRun, packing, law, {"stress": stress, "tolerance": tolerance, "background": background})
    with Recording(packing, law, tolerance, background, file.before) as flow:
        before = file.before
        residual = before.residual if before else flow.session.drive("rate 0", duration).elastic_stress

        def result() -> CreepRun:
            return CreepRun(**flow.content(), applied=stress, residual=residual, duration=duration)

        done = flow.rows[-1].time if flow.rows else 0.0
        if done < duration * (1 - 1e-12):
            flow.drive(f"stress {residual + stress:.17g}", duration - done)
        for state in flow.advance_log_spaced(duration):
            file.save(result)
            if progress is not None:
                progress(f"time {state.time:.3g}, strain {state.strain:.3g}", state.time / duration)
            if abs(state.strain) > largest_strain:
                break
        found = result()
    file.save(lambda: found, now=True)
    return found
