"""Spectra, flows and slow shear."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from constant_battery import droplets, jamlab, read, scenario

OMEGA = np.logspace(-4, 1, 6)


@scenario
def spectra(folder):
    p, q = read(folder, "sp64"), droplets()
    ways = ("auto", "dense", "direct", "reduced")
    return [
        *(jamlab.complex_modulus(p, OMEGA, method=way) for way in ways),
        *(jamlab.complex_modulus(q, OMEGA, method=way) for way in ways),
        jamlab.complex_modulus(p, OMEGA, jamlab.StokesDrag(1.0)),
        jamlab.complex_modulus(p, OMEGA, prestress=False),
        jamlab.complex_modulus(p, OMEGA, jamlab.ContactDamping(beta=0.0)),
    ]


@scenario
def spectra_of_many(folder):
    p = read(folder, "sp500")
    return [jamlab.complex_modulus(p, OMEGA, method=way) for way in ("auto", "direct", "reduced")]


@scenario
def spectra_marginal(folder):
    omega = np.logspace(-9, 3, 7)
    return [jamlab.complex_modulus(read(folder, name), omega, prestress=False) for name in ("marginal", "walled")] + [
        jamlab.complex_modulus(read(folder, "sticky"), omega)
    ]


@scenario
def spectra_of_sticky_contacts(folder):
    found = []
    for beta in (1e-6, 1e3, 1e6):
        for way in ("dense", "direct", "reduced"):
            try:
                law = jamlab.ContactDamping(beta=beta)
                found.append(jamlab.complex_modulus(read(folder, "sp16"), OMEGA, law, method=way))
            except jamlab.JamlabError as error:
                found.append(type(error).__name__)
    return found


@scenario
def nonlinear(folder):
    p = read(folder, "sp16")
    return [
        jamlab.nonlinear_modulus(p, [0.01, 1.0], jamlab.ContactDamping(alpha=0.5), stress=1e-4),
        jamlab.nonlinear_modulus(p, [1.0], jamlab.ContactDamping(alpha=0.7), amplitude=1e-3),
        jamlab.effective_relaxation_time([0.1, 1.0], 1e-3, 0.5),
    ]


@scenario
def response(folder):
    p = read(folder, "sp64")
    return [
        jamlab.displacement_correlation(p, 1e-2),
        jamlab.displacement_response(p, 1e-2)[1],
        jamlab.mode_character(read(folder, "dp8")),
        jamlab.mode_character(droplets()),
        *jamlab.dynamical_matrices(read(folder, "sp16")),
    ]


@scenario
def collapse(folder):
    pressures = (0.03, 0.01, 0.003)
    spectra = [
        [jamlab.complex_modulus(jamlab.pack(16, q, seed=s), np.logspace(-4, 0, 5), prestress=False) for s in (1,)]
        for q in pressures
    ]
    return jamlab.scaling_collapse(pressures, spectra, resamples=20)


def _of_run(run: Any) -> Any:
    names = ("time", "strain", "stress", "pressure", "dissipated", "iterations")
    return {name: getattr(run, name, None) for name in names} | {"last": run.packing.positions}


@scenario
def shear(folder):
    p = read(folder, "sp16")
    runs = [
        jamlab.shear(p, rate=1e-2, strain=0.1, rows=20, snapshot_every=0.05),
        jamlab.shear(p, rate=1e-3, strain=0.02, rows=5, tolerance=1e-3),
        jamlab.shear(read(folder, "sp64"), rate=1e-2, strain=0.02, rows=5, trajectory_error=True),
    ]
    return [*(_of_run(run) for run in runs), runs[0].velocity_profile, runs[0].summary]


@scenario
def shear_contact_damping(folder):
    p = read(folder, "sp16")
    laws = (jamlab.ContactDamping(beta=0.1), jamlab.ContactDamping(alpha=0.5), jamlab.StokesDrag(1.0))
    return [_of_run(jamlab.shear(p, 1e-2, 0.03, law, rows=5)) for law in laws]


@scenario
def shear_droplets(folder):
    return _of_run(jamlab.shear(read(folder, "dp8"), rate=1e-2, strain=0.01, rows=3))


@scenario
def shear_walls(folder):
    return [_of_run(jamlab.shear(read(folder, name), rate=1e-2, strain=0.02, rows=4)) for name in ("walled", "flat")]


@scenario
def curve(folder):
    p = read(folder, "sp16")
    found = jamlab.flow_curve(p, [0.03, 0.1, 0.3], strain=1.0, discard=0.5)
    return [found, jamlab.flow_cost(p, [0.01, 0.1], strain=0.5).select_dtypes("number").shape]


@scenario
def creep(folder):
    p, law = read(folder, "sp16"), jamlab.ContactDamping()
    runs = [
        jamlab.creep(p, 1e-4, 30.0, law),
        jamlab.creep(p, 3e-2, 10.0, law, largest_strain=1.0),
        jamlab.relax_stress(p, 1e-3, 10.0, law),
        jamlab.stop_flow(jamlab.shear(p, rate=0.1, strain=0.05, rows=3), 20.0),
    ]
    return [each for run in runs for each in (_of_run(run), getattr(run, "state", None), str(run))]


@scenario
def oscillation(folder):
    p, law = read(folder, "sp16"), jamlab.ContactDamping()
    return [jamlab.oscillate(p, *how, law, cycles=3, points_per_cycle=16) for how in ((1.0, 1e-4), (0.1, 0.02))]


@scenario
def quasistatic(folder):
    p = read(folder, "sp16")
    return [
        jamlab.quasistatic_shear(p, 0.1, strain_step=0.005),
        jamlab.quasistatic_shear(read(folder, "sp64"), 0.03, strain_step=0.005, pressure=1e-3),
        jamlab.quasistatic_shear(read(folder, "stabilized"), 0.02, strain_step=0.01, pressure=1e-2),
        jamlab.quasistatic_shear(read(folder, "walled"), 0.02, strain_step=0.01),
    ]


@scenario
def quasistatic_droplets(folder):
    return jamlab.quasistatic_shear(droplets(), 0.02, strain_step=0.01)


@scenario
def movie(folder):
    run = jamlab.shear(read(folder, "sp16"), rate=0.1, strain=0.04, rows=3, snapshot_every=0.02)
    with tempfile.TemporaryDirectory() as kept:
        frames = jamlab.write_movie(Path(kept) / "a.gif", run)
        return [frames, str(run)]
