"""One small object of every class of results, and of those that hint at what to use."""

from dataclasses import fields
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pandas as pd
from campaigns import written

import jamlab
from jamlab.flow.flow_curve import FlowCurve

MICROGRAPH = np.kron(np.arange(1, 17).reshape(4, 4), np.pad(np.ones((20, 20), int), 2)).astype(int)
STATES = Path(__file__).parents[1] / "states"
EVENTS = pd.DataFrame({"task": "a", "seed": 1, "state": 0, "strain": 0.1, "energy": np.linspace(1, 5, 12) ** 2})
RATES = np.array([0.01, 0.03, 0.1, 0.3])


@cache
def objects():
    """Class name -> an object, which no test changes; flows are short, and a flow curve and an estimate are written by
    hand."""
    folder = Path(mkdtemp())
    p = jamlab.pack(16, 1e-2, seed=1)
    droplets = jamlab.read(STATES / "compressed_droplets.h5")
    walled = jamlab.with_walls(jamlab.pack(32, 1e-2, seed=1), thickness=1.5)
    damping, omega = jamlab.ContactDamping(), [1e-2, 0.1, 1.0]
    run = jamlab.shear(p, rate=0.1, strain=0.02, rows=3, snapshot_every=0.01)
    steady = jamlab.quasistatic_shear(p, 0.02, strain_step=0.01, snapshot_every=0.01)
    cyclic = jamlab.quasistatic_shear(p, [2e-3, -2e-3, 0.0], strain_step=2e-3, cycles=4)
    sheared = jamlab.quasistatic_shear(p, 0.05, strain_step=0.01, event_width=5e-3)
    voids = jamlab.voids(p)
    spectra = [[jamlab.complex_modulus(jamlab.pack(8, q, seed=1), omega, prestress=False)] for q in (0.03, 0.02, 0.01)]
    campaign = jamlab.open_campaign(written(folder / "c.toml", n=8, seeds=1, compress=None, pressures=[1e-2]))
    q = jamlab.pack(16, 1e-2, seed=2)
    means = jamlab.mean_spectra([p, q], omega, prestress=False)
    numbers = [each.name for each in fields(jamlab.results.SteadyState) if each.type == "float"]
    choice = jamlab.estimate_cost("z", rho=0.9, error=0.1)
    found = [
        *(p, run, steady, sheared.events, run.velocity_profile, voids, jamlab.void_statistics(voids), campaign, choice),
        *(jamlab.evaluate(p), jamlab.contacts(p), jamlab.contacts(p).forces, jamlab.contact_lengths(droplets)),
        *(jamlab.tessellation(p), jamlab.hexatic_order(p), jamlab.elastic_tensor(p), jamlab.nonaffine_response(p)),
        *(jamlab.maxwell_count(p), jamlab.rigid_clusters(p), jamlab.lowest_modes(p, 4), jamlab.slab(walled)),
        *(jamlab.density_of_states([p, q]), jamlab.local_strain(p, steady.packing), jamlab.local_strain(steady)),
        *(jamlab.anneal(p, 1e-4, 1.0), jamlab.swap_sizes(p, 1e-4, 1)),
        *(jamlab.softening(sheared), jamlab.event_sizes(EVENTS, least_size=1.0)),
        *(jamlab.mean_square_displacement(steady), jamlab.self_overlap(steady), jamlab.t1_events([q, q])),
        jamlab.pair_correlation([p, q], 3.0),
        *(jamlab.displacement_spectrum(p, 9.0), jamlab.displacement_spectrum(p, 9.0).shells()),
        jamlab.spectral_density(p, 9.0),
        jamlab.structure_factor(p, 9.0),
        jamlab.structure_factor(p, 9.0).shells(),
        jamlab.density_by_size([p, q]),
        jamlab.quasilocalized_modes(p, 3),
        jamlab.damped_vibrations(p, damping),
        *(cyclic.cycles, cyclic.limit_cycle, jamlab.results.ShearJamming(0.1, 0.11, 0.11, 1e-6, p)),
        jamlab.results.Hysterons(*np.linspace(0.1, 0.6, 6)[:, None]),
        *(spectra[0][0], spectra[0][0].spectrum, jamlab.nonlinear_modulus(p, [1.0], stress=1e-5)),
        *(means, means[0]),
        *(jamlab.displacement_correlation(p, 1.0), jamlab.micrograph(labels=MICROGRAPH)),
        jamlab.scaling_collapse([0.03, 0.02, 0.01], spectra, resamples=0),
        jamlab.results.ModeCharacter(*np.linspace(0.1, 1.0, 21).reshape(7, 3)),
        jamlab.oscillate(p, 1.0, 1e-4, damping, cycles=2, points_per_cycle=16),
        jamlab.creep(p, 2e-3, 1.0, damping),
        jamlab.relax_stress(p, 1e-3, 1.0, damping),
        jamlab.stop_flow(run, 1.0),
        flow_curve(p, run),
        flow_curve(p, run).herschel_bulkley(),
        jamlab.mean_flow_curve([flow_curve(p, run, 0.01), flow_curve(q, run, 0.011)]),
        jamlab.results.SteadyState(**dict.fromkeys(numbers, 0.1)),
        jamlab.results.Estimate(5.0, 0.1, True, 3, 0, 1.0, choice, np.array([4.9, 5.0, 5.1]), np.arange(3)),
    ]  # fmt: skip
    micrograph = next(each for each in found if type(each).__name__ == "Micrograph")
    return {type(each).__name__: each for each in [*found, micrograph.voids]}


def flow_curve(packing, run, stress=0.01):
    """A flow curve with a yield stress, without a run."""
    arrays = {name: np.full(len(RATES), 0.1) for name in FlowCurve.columns if name != "finished"}
    arrays |= {"rate": RATES, "stress": stress + 0.1 * np.sqrt(RATES), "stress_stderr": np.full(len(RATES), 1e-4)}
    plain = {each.name: getattr(run, each.name) for each in fields(run) if each.name in ("damping", "unit")}
    return FlowCurve(
        frames=(packing,) * 5, background_drag=0.0, tolerance=1e-3, discard=1.0, strain=1.0, **plain, **arrays
    )
