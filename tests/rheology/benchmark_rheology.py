"""Cost of G*(omega): the reduced model against one complex factorisation per frequency. pytest -m benchmark -s.

Prints a table and one JSON object. Ratios, not seconds, are what other machines should reproduce.
"""

import json
import time

import numpy as np
import pytest

import jamlab
from jamlab import ContactDamping, StokesDrag
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.positive_solver import backend
from jamlab.mechanics.symmetric_factors import SymmetricFactors
from jamlab.rheology.equation_of_motion import equation_of_motion
from jamlab.rheology.rounding_error import solve_frequency

OMEGA = np.logspace(-8, 4, 400)
SIZES = (512, 1024, 2048, 4096)
LAWS = {"contact": ContactDamping(), "stokes": StokesDrag()}


def best(run, times=3):
    """Shortest of a few runs, s: what the machine needs when nobody else uses it."""
    spans = []
    for _ in range(times):
        start = time.perf_counter()
        result = run()
        spans.append(time.perf_counter() - start)
    return min(spans), result


def bare_factorisation(motion, omega):
    """One complex symmetric LU and one solve, no refinement and no error estimate."""
    column = motion.k_qg + 1j * omega * motion.b_qg
    return SymmetricFactors((motion.k_qq + 1j * omega * motion.b_qq).tocsc()).solve(column)


@pytest.mark.benchmark
@pytest.mark.parametrize("name", LAWS)
def test_speed_of_the_reduced_model(name):
    law = LAWS[name]
    rows = []
    for n in SIZES:
        p = jamlab.pack(n=n, pressure=1e-4, seed=1)
        motion = equation_of_motion(force_network(p), law)
        jamlab.complex_modulus(p, OMEGA[:2], law, method="reduced")  # imports
        seconds, s = best(lambda p=p: jamlab.complex_modulus(p, OMEGA, law, method="reduced"))
        some = OMEGA[::80]
        direct = jamlab.complex_modulus(p, some, law, method="direct")
        each, _ = best(lambda motion=motion: solve_frequency(motion, 1e-2), 5)
        bare, _ = best(lambda motion=motion: bare_factorisation(motion, 1e-2), 5)
        error = max(np.abs(s.storage[::80] / direct.storage - 1).max(), np.abs(s.loss[::80] / direct.loss - 1).max())
        rows.append(
            {
                "n": n,
                "reduced_s": seconds,
                "lines": len(s.spectrum.rates),
                "direct_s": each,
                "bare_lu_s": bare,
                "ratio_direct": len(OMEGA) * each / seconds,
                "ratio_bare_lu": len(OMEGA) * bare / seconds,
                "error": float(error),
                "estimate": float(s.error.max()),
            }
        )
    exponent = float(np.polyfit(np.log(SIZES), np.log([row["reduced_s"] for row in rows]), 1)[0])
    print(f"\n{name}, {len(OMEGA)} frequencies, {backend()}; cost ~ N^{exponent:.2f}")
    print("  ".join(f"{key:>13}" for key in rows[0]))
    for row in rows:
        print("  ".join(f"{value:13.4g}" for value in row.values()))
    print(json.dumps({"law": name, "backend": backend(), "exponent": exponent, "rows": rows}))
    assert all(row["error"] < 1e-8 for row in rows)
