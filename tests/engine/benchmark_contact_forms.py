"""Contact forms of polygons side by side: smoothness, convergence, onset, cost, speed, ranks. pytest -m benchmark -s.

JAMLAB_SEEDS sets how many seeds (8), JAMLAB_RESULTS a folder where each result is kept as it comes, so that a run can
go on where it was stopped. Prints tables and one JSON object each.
"""

import json
import os
import re
import time

import contact_paths
import deck_runs
import numpy as np
import pytest
from kept_results import kept_rows
from tiled_packings import tiled

import jamlab
from jamlab.engine.installation import start_lammps
from jamlab.packing.law_parameters import CONTACT_FORMS
from jamlab.protocols.relaxation import force_tolerance, relax

SEEDS = int(os.environ.get("JAMLAB_SEEDS", "8"))
SIZES = (8, 12, 16)
RHO = (0.86, 0.90, 0.94)
KICK = 1e-3  # l: all forms start equally far from a minimum


def onset(form, n, seed):
    """rho and z at onset in one form, or the error."""
    began = time.process_time()
    try:
        p = jamlab.jam("dp", n, seed, contact=form)
        row = {"rho": jamlab.packing_fraction(p), "z": jamlab.contacts(p).z}
    except jamlab.JamlabError as error:
        row = {"error": str(error)}
    return row | {"t": time.process_time() - began}


def minima(form, n, seed, starts):
    """Largest force that is reached from the same states in every form, and the time."""
    if (n, seed) not in starts:
        try:
            first = jamlab.jam("dp", n, seed)
            states = [*jamlab.compress(first, to=RHO[-1], step=RHO[1] - RHO[0])]
            starts[n, seed] = [p for p in states if jamlab.packing_fraction(p) > RHO[0] - 0.02]
        except jamlab.JamlabError:
            starts[n, seed] = []  # the default form finds no onset for this seed
    forces, seconds = [], []
    for k, p in enumerate(starts[n, seed]):
        kicked = p.positions + np.random.default_rng([n, seed, k]).normal(0, KICK, p.positions.shape)
        began = time.process_time()
        try:
            with jamlab.Session(p.with_state(positions=kicked, params=p.params | {"contact": form})) as session:
                found = relax(session)
            forces.append(found.evaluation.max_force if found.converged else max(found.evaluation.max_force, 1e-9))
        except jamlab.JamlabError:
            forces.append(float("inf"))
        seconds.append(time.process_time() - began)
    return {"forces": forces, "t": seconds}


@pytest.mark.benchmark
def test_forms_side_by_side(kept_folder):
    """Continuity along paths; fraction of minimisations below 1e-10; rho_J and z_J; wall time."""
    smooth = {}
    print(f"\n{'form':16s}{'shape':8s}{'path':10s}{'class':6s} energy jump  force jump  (of the largest on the path)")
    for form, shape, path, s in contact_paths.table(CONTACT_FORMS):
        print(f"{form:16s}{shape:8s}{path:10s}{s.name:6s} {s.energy_jump:10.1e}  {s.force_jump:10.1e}")
        smooth[form] = min(smooth.get(form, "C1"), s.name)

    keys = [(form, n, seed) for n in SIZES for seed in range(1, SEEDS + 1) for form in CONTACT_FORMS]
    starts = {}
    at_onset = kept_rows(kept_folder / "form-onsets.jsonl", ("form", "n", "seed"), keys, onset)
    names = ("form", "n", "seed")
    reached = kept_rows(kept_folder / "form-minima.jsonl", names, keys, lambda *key: minima(*key, starts))

    print(f"\n{'form':16s}{'class':6s} minima <1e-10  median s   onsets  rho_J +- sd        z_J   median s")
    result = {}
    for form in CONTACT_FORMS:
        forces = np.array([f for row in reached if row["form"] == form for f in row["forces"]])
        seconds = np.array([t for row in reached if row["form"] == form for t in row["t"]])
        rows = [row for row in at_onset if row["form"] == form]
        good = [row for row in rows if "rho" in row]
        rho, z = np.array([row["rho"] for row in good]), np.array([row["z"] for row in good])
        result[form] = {
            "continuity": smooth[form],
            "minima": len(forces),
            "converged": float(np.mean(forces <= force_tolerance("dp"))),
            "minimum_seconds": float(np.median(seconds)),
            "onsets": len(good),
            "tried": len(rows),
            "rho_J": float(rho.mean()) if len(rho) else None,
            "rho_J_sd": float(rho.std()) if len(rho) else None,
            "z_J": float(np.nanmean(z)) if len(z) else None,
            "onset_seconds": float(np.median([row["t"] for row in rows])),
        }
        r = result[form]
        jammed = f"{r['rho_J']:.4f} +- {r['rho_J_sd']:.4f} {r['z_J']:8.3f}" if good else f"{'none':>25s}"
        print(
            f"{form:16s}{r['continuity']:6s} {r['converged']:7.1%} of {r['minima']:3d} {r['minimum_seconds']:9.2f} "
            f"{r['onsets']:4d}/{r['tried']:<3d} {jammed} {r['onset_seconds']:9.2f}"
        )
    print(json.dumps(result))
    assert result["outline"]["converged"] > result["segment"]["converged"]


DECK = """
units lj
dimension 2
atom_style molecular
fix d_a0 all property/atom d_a0
read_data {data} fix d_a0 NULL d_a0 nocoeff
special_bonds lj/coul 1.0 1.0 1.0
{forces}
neighbor 0.1 bin
neigh_modify every 1 delay 0 check yes
timestep 0.005
"""
PLUGIN = """
bond_style line/tension
bond_coeff * 0.4
pair_style circuloline 0.25 1.5 contact {form}
pair_coeff * * 1.0
fix area all polygon/area 300.0 d_a0
"""
LAMMPS_OWN = """
bond_style harmonic
bond_coeff * 1e-3 0.25
pair_style harmonic/cut
pair_coeff * * 1e-3 0.25
"""
MOTION = """
velocity all create 0.01 4711 loop geom
fix move all nve
fix flat all enforce2d
"""


def nanoseconds(data, forms, motion, steps):
    """CPU ns a vertex and step of each form, and of LAMMPS' own pairs and bonds last: least of runs in turns;
    in motion, where neighbour lists are made now and then, their lower quartile."""
    forces = [PLUGIN.format(form=form) for form in forms] + [LAMMPS_OWN]
    both = [start_lammps() for _ in forces]
    for lmp, lines in zip(both, forces, strict=True):
        lmp.commands_string(DECK.format(data=data, forces=lines) + (MOTION if motion else "") + "run 0 post no")
    seconds = np.zeros((20, len(both)))
    for row in seconds:
        for k, lmp in enumerate(both):
            began = time.process_time()
            lmp.command(f"run {steps} pre no post no")
            row[k] = time.process_time() - began
    found = np.quantile(seconds, 0.25 if motion else 0.0, axis=0) * 1e9 / (steps * both[0].get_natoms())
    for lmp in both:
        lmp.close()
    return found


@pytest.mark.benchmark
def test_cost_beside_pairs_and_bonds_of_lammps(tmp_path):
    """All forces of form outline: at most 1.6 times `harmonic/cut` with harmonic bonds between the same vertices."""
    *_, first = jamlab.compress(jamlab.jam("dp", 12, 1), to=0.92, step=0.03)
    ratios = {}
    print(
        f"\nns a vertex and step\n{'vertices':>9} {'':9}"
        + "".join(f"{form:>16}" for form in (*CONTACT_FORMS, "LAMMPS"))
    )
    for times in map(int, os.environ.get("JAMLAB_TIMES", "3 8 24").split()):
        p = tiled(first, times)
        jamlab.write_data(tmp_path / "p.data", p)
        for motion in (False, True):
            least = 40 if motion else 8
            found = nanoseconds(tmp_path / "p.data", CONTACT_FORMS, motion, max(least, 150_000 // len(p.positions)))
            ratios[len(p.positions), motion] = found[CONTACT_FORMS.index("outline")] / found[-1]
            print(f"{len(p.positions):9d} {'moving' if motion else 'at rest':9}" + "".join(f"{v:16.1f}" for v in found))
    print(" ".join(f"{size} {'moving' if motion else 'at rest'}: {v:.2f}" for (size, motion), v in ratios.items()))
    assert max(ratios.values()) < 1.6


@pytest.mark.benchmark
def test_two_ranks_beside_one(tmp_path):
    """Time of the loop in plain lmp, best of three in turns, on two idle cores: at least 1.85 times one rank."""
    *_, first = jamlab.compress(jamlab.jam("dp", 12, 1), to=0.92, step=0.03)
    jamlab.write_data(tmp_path / "p.data", tiled(first, 24))
    deck = DECK.format(data="p.data", forces=PLUGIN.format(form="outline")) + MOTION + "run 200\n"
    (tmp_path / "in.two").write_text("processors * * 1\n" + deck)
    seconds = {1: [], 2: []}
    for _ in range(3):
        for ranks, found in seconds.items():
            output = deck_runs.run("in.two", tmp_path, inputs=tmp_path, ranks=ranks)
            found.append(float(re.search(r"Loop time of (\S+)", output)[1]))
    one, two = min(seconds[1]), min(seconds[2])
    print(f"\n100 000 vertices: {one:.2f} s on one rank, {two:.2f} s on two: {one / two:.2f} times")
    assert one > 1.85 * two
