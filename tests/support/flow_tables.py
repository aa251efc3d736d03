"""Tables of flow, made up, in which known laws hold: for tests of the figures that are drawn from them."""

from itertools import product

import numpy as np
import pandas as pd

ONSET, Q, W = 0.84347, 0.45, 0.32  # where flow is critical, and its exponents
YIELD, HERSCHEL = 8e-4, 0.52  # of quasi-static shear; exponent at packing fraction 0.86
SEEDS = range(1, 7)
FRACTIONS = (0.80, 0.82, 0.83, 0.84, 0.85, 0.86, 0.88)
SOFT_OVER_PRESSURE = 0.3
_DISKS = {"model": "sp", "ensemble": "fixed-box", "damping": "contact", "beta": 1.0, "eta_f": np.nan, "rho": np.nan}
_DISKS["target_pressure"] = np.nan
_USUAL = {**_DISKS, "n": 256, "alpha": 1.0, "background_drag": 1e-2, "tolerance": 5e-2}


def _noise(seed, size=0.02):
    return 1 + size * np.cos(2.4 * seed)


def _stress(phi, rate, critical=False):
    """A flow curve that collapses, and at 0.86, unless critical, one with a yield stress."""
    if phi == 0.86 and not critical:
        return YIELD + 0.12 * rate**HERSCHEL
    return 0.1 * rate**Q * np.exp((phi - ONSET) / rate**W * 2)


def _flow_row(seed, stress, **entries):
    noisy = stress * _noise(seed)
    steady = {"stress": noisy, "stress_stderr": 0.02 * noisy, "elastic_stress": 0.8 * noisy}
    peak = {"peak_stress": 1.3 * noisy, "peak_strain": 0.3, "flow_pressure": 4 * noisy}
    errors = {"elastic_stress_stderr": 0.02 * noisy, "flow_pressure_stderr": 0.02 * noisy, "converged": True}
    return {**_USUAL, "seed": seed, **steady, **peak, **errors, **entries}


def flow(critical=False):
    """Steady flow around onset."""
    rows = [
        _flow_row(seed, _stress(phi, rate, critical), phi=phi, rate=rate)
        for seed, phi, rate in product(SEEDS, FRACTIONS, (1e-4, 1e-3, 3e-3, 1e-2, 1e-1))
    ]
    return pd.DataFrame(rows)


def quasistatic_shear():
    """At 0.86 the yield stress."""
    return pd.DataFrame([_flow_row(seed, YIELD, phi=0.86) for seed in SEEDS])


def oscillation():
    """Moduli that fall at an amplitude in proportion to pressure; equivalent damping 30 % too high at alpha = 1/2."""
    rows = []
    for seed, p, omega, amplitude in product(SEEDS, (3e-3, 1e-2, 3e-2), (1e-3, 1e-2, 1e-1), np.geomspace(1e-5, 1, 21)):
        modulus = 0.3 * p**0.5 * _noise(seed) / (1 + 3 / 7 * amplitude / (SOFT_OVER_PRESSURE * p))
        rows.append(_oscillation_row(seed, p, omega, amplitude, modulus, 0.5 * modulus))
    for seed, alpha, omega in product(SEEDS, (0.5, 0.75, 1.0), (1e-3, 1e-2, 1e-1)):
        how = {"alpha": alpha, "background_drag": 1e-4, "factor": 1.3 if alpha == 0.5 else 1.0}
        rows.append(_oscillation_row(seed, 1e-2, omega, 1e-4, 0.03 * _noise(seed), 0.03, **how))
    return pd.DataFrame(rows)


def _oscillation_row(seed, pressure, omega, amplitude, storage, loss, factor=1.0, **entries):
    linear = {"equivalent_storage": factor * storage, "equivalent_loss": factor * loss, "equivalent_time": 1.0}
    found = {"storage": storage, "loss": loss, "third_over_first": 0.0, "change": 0.0, "converged": True}
    place = {"n": 64, "phi": np.nan, "target_pressure": pressure, "omega": omega, "amplitude": amplitude}
    return {**_USUAL, "seed": seed, **place, **linear, **found, **entries}


TABLES = {"flow": flow, "quasistatic_shear": quasistatic_shear, "oscillation": oscillation}
