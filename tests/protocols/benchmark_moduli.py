"""Scaling of disks above onset, and moduli by two methods. pytest -m benchmark -s.

Prints tables and one JSON object each: z - z_J and G against phi - phi_J, their small-size regime, linear response
against finite strain, and G_0 against pressure.
"""

import json

import numpy as np
import pytest

import jamlab
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, modulus_along
from jamlab.statistics.bootstrap import bootstrap

RESAMPLES = 2000


def power_law(x, y):
    """Exponent and prefactor of the mean over packings of y (packings, points), with bootstrap 95 % intervals."""

    def fit(groups):
        log_y = np.log(np.maximum(np.nanmean(groups[0], axis=0), 1e-12))
        return np.polyfit(np.log(x), log_y, 1)[0], np.exp(np.mean(log_y - 0.5 * np.log(x)))

    found = bootstrap([y], fit, resamples=RESAMPLES)
    rows = np.round([found.value, found.low, found.high], 4).T.tolist()
    return {"exponent": rows[0], "prefactor_at_exponent_one_half": rows[1]}


def sweep(n, seed, to=0.3):
    """d_phi, N_c - N_c at onset, z - z_J and G of the states above one onset."""
    onset = jamlab.jam("sp", n, seed)
    at_onset = jamlab.contacts(onset)
    rows = []
    for p in jamlab.compress(onset, onset.phi + to, 0.02, by="phi", nearest=1e-7):
        c = jamlab.contacts(p)
        try:
            g, extra, z = jamlab.shear_modulus(p, average=True), c.count - at_onset.count, c.z - at_onset.z
        except jamlab.ConvergenceError:  # it fell apart: in a box that is not sheared a small packing can
            g = extra = z = np.nan
        rows.append((p.provenance["target"] - onset.phi, extra, z, g))
    return np.array(rows).T


@pytest.mark.benchmark
def test_scaling_above_onset():
    """N = 256, 20 seeds, 1e-2 < d_phi < 0.1: beside exponent 0.5, z_0 = 3.7, G_0 = 0.42 ([B] tables 1 and 2)."""
    runs = [sweep(256, seed) for seed in range(1, 21)]
    x = runs[0][0]
    z, g = (np.array([run[k] for run in runs]) for k in (2, 3))
    print("\n   d_phi  jammed   z - z_J     G")
    jammed = np.isfinite(z).sum(axis=0)
    for row in zip(x, jammed, np.nanmean(z, axis=0), np.nanmean(g, axis=0), strict=True):
        print("{:9.3g} {:5d} {:10.4f} {:9.5f}".format(*row))
    window = (x > 0.009) & (x < 0.11)
    for name, values in (("z - z_J", z), ("G", g)):
        print(json.dumps({"quantity": name, **power_law(x[window], values[:, window])}))


@pytest.mark.benchmark
def test_small_packings_gain_contacts_later():
    """d_phi* at which half of the packings have one contact more than at onset ~ N^-2, G there ~ 1/N."""
    sizes, first, plateau = (16, 32, 64, 128), [], []
    for n in sizes:
        runs = [sweep(n, seed, to=0.02) for seed in range(1, 41)]
        x = runs[0][0]
        extra = np.array([run[1] for run in runs])
        share = np.nansum(extra >= 1, axis=0) / np.isfinite(extra).sum(axis=0)
        first.append(float(np.exp(np.interp(0.5, share, np.log(x)))))
        plateau.append(float(np.nanmean([run[3][x < first[-1]] for run in runs])))
        print(f"\nN = {n}: d_phi* = {first[-1]:.3g}, mean G below it = {plateau[-1]:.4g}", end="")
    exponent = float(np.polyfit(np.log(sizes), np.log(first), 1)[0])
    print("\n" + json.dumps({"d_phi*": first, "exponent": exponent, "expected": -2, "G_below": plateau}))


@pytest.mark.benchmark
def test_linear_response_against_finite_strain():
    """20 packings, N = 64, d_phi = 1e-4 .. 0.3: relative difference of G; above 1e-5 the contacts are to blame."""
    print("\nseed   d_phi      G linear     G strain     difference")
    worst = 0.0
    for seed, d_phi in zip(range(1, 21), np.logspace(-4, np.log10(0.3), 20), strict=True):
        onset = jamlab.jam("sp", 64, seed)
        *_, p = jamlab.compress(onset, onset.phi + d_phi, d_phi / 4, by="phi")
        linear = jamlab.shear_modulus(p)
        try:
            strained = jamlab.shear_modulus(p, "finite-strain")
        except jamlab.ConvergenceError as error:
            print(f"{seed:4d} {d_phi:9.3g} {linear:12.6g}  refused: {error}")
            continue
        difference = abs(strained - linear) / abs(jamlab.shear_modulus(p, "affine"))
        worst = max(worst, difference)
        print(f"{seed:4d} {d_phi:9.3g} {linear:12.6g} {strained:12.6g} {difference:11.2g}")
    print(json.dumps({"worst_over_affine_modulus": worst}))
    assert worst < 1e-5


@pytest.mark.benchmark
@pytest.mark.parametrize(("ensemble", "n", "count"), [("fixed-box", 2048, 4), ("shear-stabilized", 512, 8)])
def test_modulus_against_pressure(ensemble, n, count):
    """p = 1e-2 .. 1e-5, with and without pre-stress: beside G_0 ~ p^0.5 ([T])."""
    pressures, seeds = (1e-2, 1e-3, 1e-4, 1e-5), range(1, count + 1)
    g = np.full((2, len(seeds), len(pressures)), np.nan)
    for row, seed in enumerate(seeds):
        for column, pressure in enumerate(pressures):
            p = jamlab.pack(n, pressure, seed, ensemble=ensemble)
            for kind, prestress in enumerate((True, False)):
                c = jamlab.elastic_tensor(p, prestress=prestress).relaxed
                g[kind, row, column] = modulus_along(c, AVERAGING_ANGLES).mean()
            print(f"\nseed {seed} p = {pressure:g}: G_0 = {g[0, row, column]:.5g}, {g[1, row, column]:.5g}", end="")
    for kind, name in enumerate(("with pre-stress", "without")):
        result = {"ensemble": ensemble, "n": n, "kind": name, "negative": int((g[kind] < 0).sum())}
        print("\n" + json.dumps({**result, **power_law(np.array(pressures), g[kind])}), end="")
