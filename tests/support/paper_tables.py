"""Made-up tables of a campaign in which the laws of both papers hold exactly, up to scatter between packings."""

from itertools import product

import numpy as np
import pandas as pd

from studies.ensemble_tables import add_distances, stabilized_disks

SEEDS = range(1, 6)
SIZES = (32, 64, 128, 256)
DISTANCES = np.concatenate([[0.0], np.geomspace(1e-6, 1e-2, 21), np.arange(0.02, 0.43, 0.01)])
OMEGA = np.geomspace(1e-8, 1e3, 34)
PRESSURES = (1e-2, 1e-3, 1e-4, 3.16e-6)


def states(model="sp", sizes=None, z0=3.7, c=1.0):
    """SP: eq 11, C = 1, and table 1 in dphi; A - 1 ~ drho^1.5, U/N ~ dphi^2. DP: tables 1 and 2 in drho, z from 3.97 on
    at any N, areas kept."""
    rng = np.random.default_rng(1)
    rows = []
    for n, seed in product(sizes or SIZES, SEEDS):
        onset = 0.842 - 0.2 * n**-0.7 + 0.02 * n**-0.55 * rng.normal()
        z_j = 4 - 2 / n
        tilt = 1 + 0.01 * rng.normal()
        who = {"task": f"{model}{n}-{seed}", "model": model, "n": n, "seed": seed, "units": "eps"}
        for state, d in enumerate(DISTANCES):
            if model == "sp":
                phi = onset + d
                rho = onset + c * (d - d**1.5)
                x, shape, energy = d, 1 + tilt * (max(rho - onset, 0)) ** 1.5, n * d**2
                z, g = z_j + tilt * z0 * x**0.5, 0.42 * tilt * x**0.5
            else:
                x = d * 0.36
                rho, phi = onset + x, onset + x
                shape, energy = 1.02 + tilt * x**1.0, 7.0 * n
                z, g = 3.97 + tilt * (3.3 * x**0.5 + 7.1 * x), tilt * (0.07 * x**0.5 + 1.7 * x)
            place = {"ensemble": "fixed-box", "state": state, "rho_J": onset, "phi_J": onset}
            found = {"converged": True, "rho": rho, "phi": phi, "z": z, "rattlers": 0.0, "g": g}
            rows.append({**who, **place, **found, "pressure": 0.3 * x, "energy": energy, "shape_factor": shape})
    return pd.DataFrame(rows)


def droplets_above_onset():
    """Droplets of `both_models` of other seeds, followed to a distance of 2e-3 only."""
    every = add_distances(states("dp", sizes=(32, 128)))
    return every[every["d_rho"] < 2e-3].assign(start="from-disks", seed=every["seed"] + 100)


def onset():
    """sigma = 0.02 (32/N)^0.55, mean 0.842 - 0.2 N^-0.7, to the last digit; a pair beyond 2N - 1, N/4 free motions.

    One packing in N/16 has one state of self-stress, the others two.
    """
    rows = []
    for model, n in product(("sp", "dp"), (16, 32, 64, 128, 256)):
        spread = np.random.default_rng(n).normal(size=30)
        spread = (spread - spread.mean()) / spread.std(ddof=1)
        for seed, s in enumerate(spread):
            more = int(seed % max(n // 16, 2) > 0)
            jammed = 0.842 - 0.2 * n**-0.7 + 0.02 * (32 / n) ** 0.55 * s
            who = {"task": f"{model}{n}-{seed}", "model": model, "n": n, "seed": seed, "rho_J": jammed}
            z_j = 4 - 2 / n if model == "sp" else 3.97
            found = {"phi_J": jammed, "z_J": z_j, "rattlers": 0, "converged": True, "load_bearing": n}
            counts = {"pairs": 2 * n, "site_contacts": 3 * n - 1 - n // 4 + more, "self_stresses": 1 + more}
            rows.append({**who, "ensemble": "fixed-box", **found, **counts, "free_motions": n // 4})
    return pd.DataFrame(rows)


def onset_starts():
    """Droplets that are compressed from the beginning, as those of `onset`; from disks they jam 0.002 higher.

    One contact in forty only stops a droplet.
    """
    own = onset()
    droplets = own[own["model"] == "dp"].assign(start="direct", rattlers_strong=0)
    later = droplets.assign(start="from-disks", **{name: droplets[name] + 0.002 for name in ("phi_J", "rho_J")})
    both = pd.concat([droplets, later], ignore_index=True)
    return both.assign(z_strong=0.975 * both["z_J"])


def voids():
    """Ten voids a state: 4, 4 and 2 of 3, 4 and 5 sides at onset; three sides alone above 0.97, with A = 4.87."""
    rows = []
    for model, seed, (state, rho), k in product(("sp", "dp"), SEEDS, enumerate(np.arange(0.84, 1.0, 0.01)), range(10)):
        sides = 3 if k < 4 or rho > 0.97 else 4 if k < 8 else 5
        who = {"task": f"{model}64-{seed}", "model": model, "n": 64, "seed": seed, "state": state}
        place = {"ensemble": "fixed-box", "rho": rho, "rho_J": 0.84}
        void = {"sides": sides, "area": 0.1 * (1 - rho) + 1e-4 * seed, "perimeter": 1.0}
        rows.append({**who, **place, **void, "shape_factor": 4.87 if sides == 3 else 3.0, "particle_area": 1.0})
    return pd.DataFrame(rows)


def modulus(omega, p, beta, eta_f, scatter):
    """G* with mu = 1/2, lambda = 1, Delta = 1/2: p^0.5 (1 + i x)^0.5 with x = beta omega/p, and a fluid."""
    value = scatter * p**0.5 * (1 + 1j * beta * omega / p) ** 0.5 + 1j * eta_f * omega
    return value.real, value.imag, scatter * p**0.5, 0.5 * scatter * beta * p**-0.5 + eta_f


def spectra():
    """Contact damping and Stokes drag with the exponents of the paper; beta = 0 is G_0 (1 + i omega)."""
    rng = np.random.default_rng(2)
    rows = []
    full = [("contact", b, np.nan) for b in (0.0, 1.0)] + [("stokes", np.nan, 1.0)]
    scanned = [("contact", b, np.nan) for b in (0.0, 1e-2, 1.0)] + [("stokes", np.nan, e) for e in (1.0, 1e3)]
    kinds = [(32_768, "fixed-box", PRESSURES, full, OMEGA), (2048, "fixed-box", (1e-4,), scanned, OMEGA)]
    kinds += [(n, "shear-stabilized", (*PRESSURES, 0.1), full[1:], OMEGA[:2]) for n in (256, 1024)]
    for n, ensemble, pressures, laws, omega in kinds:
        for seed in SEEDS:
            scatter = 1 + 0.02 * rng.normal()
            for p, (law, beta, eta_f), prestress in product(pressures, laws, (True, False)):
                if law == "stokes":
                    storage, loss, g0, eta0 = modulus(omega, p, 1.0, 1e-9 * eta_f, scatter)
                else:
                    storage, loss, g0, eta0 = modulus(omega, p, max(beta, 1e-30), 0.0, scatter)
                    loss, eta0 = loss + g0 * omega, eta0 + g0
                    if beta == 0.0:
                        storage, loss, eta0 = np.full(omega.shape, g0), g0 * omega, g0
                who = {"n": n, "seed": seed, "ensemble": ensemble, "target_pressure": p, "prestress": prestress}
                curve = {"omega": omega, "storage": storage, "loss": loss, "g0": g0, "eta0": eta0}
                of = {"damping": law, "beta": beta, "eta_f": eta_f}
                rows.append({**who, **of, **curve, "eta_inf": 1.0, "error_bound": 1e-9, "converged": True})
    return unrolled(rows, ["omega", "storage", "loss"])


def unrolled(rows, columns):
    """A table with a row for each entry of the arrays in some columns, as many in each."""
    return pd.DataFrame(rows).explode(columns, ignore_index=True).astype(dict.fromkeys(columns, float))


def quasistatic(powers=None):
    """Approach ~ p^(1/4), sliding and non-affine motion ~ p^(-1/4), or other powers of each size."""
    rng = np.random.default_rng(3)
    rows = []
    for n, seed, p, prestress in product((512, 32_768), SEEDS, (1e-2, 1e-3, 1e-4, 1e-5), (True, False)):
        f = (1 + 0.01 * rng.normal()) * p ** (powers or {}).get(n, 0.25)
        rows.append({"n": n, "seed": seed, "ensemble": "fixed-box", "pressure": p * 1.0000001})
        rows[-1] |= {"target_pressure": p, "prestress": prestress}
        rows[-1] |= {"median_normal": f, "median_tangential": 1 / f, "median_nonaffine": 2 / f}
        rows[-1] |= {"median_nonaffine_tangential": 1 / f}
        rows[-1] |= {"mean_normal": 2 * f, "mean_tangential": 2 / f, "mean_nonaffine": 4 / f}
        rows[-1] |= {"rms_normal": 3 * f, "rms_tangential": 3 / f, "contact_density": 2.0}
        rows[-1] |= {"storage_slope": 0.5, "loss_slope": 0.5, "length": 2.0}
        rows[-1] |= {"length_half_lane": 2.0, "length_quarter_lane": 2.0, "length_imaginary": 3.0}
    return pd.DataFrame(rows)


def correlation():
    """C = 1 - delta/l with l = L/4 under contact damping; under Stokes drag l (-ln p)^0.65 = (omega/p^0.5)^-0.2."""
    rng = np.random.default_rng(4)
    rows = []
    for law, n, seed in product(("contact", "stokes"), (512, 2048, 32_768), SEEDS):
        box = 0.95 * n**0.5 * (1 + 0.001 * rng.normal())
        delta = np.arange(round(box)) * box / round(box) / 2
        for p, omega in product((1e-2, 1e-3, 1e-4), (1e-8, 1e-5, 1e-2, 3e-2, 1e-1)):
            length = box / 4
            if law == "stokes" and omega > 1e-6:
                length = 12 * (omega / p**0.5) ** -0.2 / (-np.log(p)) ** 0.65
            c = 1 - delta / length * (1 + 0.01 * rng.normal())
            who = {"n": n, "seed": seed, "ensemble": "fixed-box", "pressure": p, "damping": law, "prestress": True}
            drag = {"beta": 1.0 if law == "contact" else np.nan, "eta_f": 1.0}
            rows.append({**who, **drag, "omega": omega, "box": box, "delta": delta, "c": c})
    return unrolled(rows, ["delta", "c"])


def both_models():
    """States of disks and of polygons."""
    return pd.concat([states(), states("dp")], ignore_index=True)


def stable():
    """The same disks in boxes that are sheared until stable."""
    return stabilized_disks(states(sizes=(32, 256)).assign(ensemble="shear-stabilized"))


def droplet_laws():
    """Five droplet packings of each of four laws: voids close up where rims are soft."""
    law = pd.MultiIndex.from_product([[64], range(1, 6), [0.4], [0.25, 0.5], [1.0, 10.0], [12]]).to_frame(index=False)
    law.columns = ["n", "seed", "gamma", "delta", "eps", "nv_small"]
    void = 3 + 0.1 * law["eps"]
    law = law.assign(rho_J=0.84, z_J=4.0, void_J=4.5, rho_star=0.98, void_090=3.0, void_098=void)
    return law.assign(g=0.3 + 0.01 * law["seed"], shape_factor=1.06, z_010=5.4)


TABLES = {
    "droplet_laws": droplet_laws,
    "states": both_models,
    "stabilized_disks": stable,
    "droplets_above_onset": droplets_above_onset,
    "onset": onset,
    "onset_starts": onset_starts,
    "voids": voids,
    "spectra": spectra,
    "quasistatic": quasistatic,
    "correlation": correlation,
}
