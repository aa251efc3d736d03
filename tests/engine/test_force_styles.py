"""Files for LAMMPS' own testers of styles: what they state, on ranks and by plain numpy."""

import sys
from pathlib import Path

import numpy as np
import outlines
import pytest
import yaml
from folded_outlines import folded
from plain_outline_laws import bending, perimeter

from jamlab.protocols.random_start import random_disks

from .test_plugin_on_ranks import launch

sys.path.append(str(Path(__file__).parents[2] / "plugin" / "recipes" / "lammps"))

import force_styles


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    """What the files say, by name, with the folder that they lie in."""
    folder = tmp_path_factory.mktemp("force_styles")
    paths = force_styles.write_all(folder)
    return folder, {path.stem: yaml.safe_load(path.read_text()) for path in paths}


def stated(case, field, columns=slice(None)):
    """Numbers of a field; of vectors, x and y alone."""
    rows = [row.split() for row in str(case[field]).splitlines()]
    return np.array(rows, dtype=float)[:, 1:3] if len(rows) > 1 else np.array(rows[0], dtype=float)[columns]


def adhesive(i, j):
    """Eps, width and adhesion of two types."""
    pulls, ranges = zip(*(force_styles.ADHESION[k] for k in (i, j)), strict=True)
    pull = np.sqrt(np.prod(pulls))
    return *outlines.mixed(i, j), pull, np.mean(ranges) * (pull > 0)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_testers_find_the_numbers_of_the_files(cases, tmp_path, ranks):
    """At the start, after a run, from a restart file and from a data file, with newton on and off."""
    folder, found = cases
    assert {force_styles.kind_of(case) for case in found.values()} == {"pair", "bond", "fix"}
    deck = [line for name, case in found.items() for newton in ("on", "off")
            for line in force_styles.commands(case, folder, f"{name}-{newton}", newton)]  # fmt: skip
    code, output = launch(tmp_path, "\n".join(deck), ranks)
    assert code == 0, output[-2000:]
    for name, case in found.items():
        whole = force_styles.kind_of(case) != "fix"
        for newton in ("on", "off"):
            for stage in ("init", "run", "restart", "data") if whole else ("run", "restart"):
                of = "run" if stage == "run" or not whole else "init"
                for field, value in force_styles.numbers(tmp_path / f"{name}-{newton}-{stage}", case).items():
                    wanted = stated(case, field if field.startswith("global") else f"{of}_{field}")
                    value = value[:, 1:3] if np.ndim(value) == 2 else np.ravel(value)
                    wanted, rel = wanted[-len(value) :], float(case["epsilon"])
                    same = pytest.approx(wanted, rel=rel, abs=1e-13 * np.abs(wanted).max())
                    assert value == same, (name, newton, stage, field)


def test_numbers_of_the_files_are_those_of_the_laws(cases):
    """Contacts, tension and areas of the outlines; energies of disks."""
    _, found = cases
    of_form = [(form.replace("/", "_"), outlines.scene(3), form, outlines.mixed) for form in outlines.FORMS]
    own = ("self", folded(), "segment/smooth", outlines.mixed)
    for name, state, form, law in (*of_form, ("adhesion", outlines.scene(3), "outline", adhesive), own):
        case, forces = found[f"mol-pair-circuloline-{name}"], np.zeros_like(state.points)
        contacts = outlines.contacts(state, law, form)
        for c in contacts:
            for number, share in ((c.vertex, 1.0), (c.tail, c.t - 1.0), (c.head, -c.t)):
                forces[number] += share * c.force
        assert stated(case, "init_forces") == pytest.approx(forces, abs=1e-12 * np.abs(forces).max())
        assert case["init_vdwl"] == pytest.approx(sum(c.energy for c in contacts), rel=1e-12)
        virial = sum(np.outer(c.separation, c.force) for c in contacts)
        stress = stated(case, "init_stress", [0, 1, 3])
        assert stress == pytest.approx(virial[[0, 1, 0], [0, 1, 1]], abs=1e-12 * np.abs(virial).max())
    assert len(outlines.contacts(folded())) > len(outlines.contacts(folded(near=0.0)))
    state = outlines.scene(3)
    edges = np.concatenate([outlines.lengths(o) for o in state.outlines if o.type != outlines.DISK])
    tension = force_styles.GAMMA * np.hypot(edges, force_styles.ETA).sum()
    assert found["bond-line_tension"]["init_energy"] == pytest.approx(tension, rel=1e-12)

    of_outlines = {
        "area": lambda ring: outlines.area_force(ring, force_styles.KA, force_styles.A0)[0],
        "bending": lambda ring: bending(ring, force_styles.KAPPA, force_styles.THETA0),
        "perimeter": lambda ring: perimeter(ring, force_styles.A0, force_styles.KP, force_styles.KL, force_styles.P0),
    }
    for name, energy_of in of_outlines.items():
        case = found[f"fix-timestep-polygon_{name}"]
        off = stated(case, "run_pos") - state.points
        end, energy = state.points + off - np.rint(off / state.box) * state.box, 0.0
        for first, o in zip(state.starts, state.outlines, strict=False):
            if o.type == outlines.RING:
                energy += energy_of(end[first : first + len(o.points)])
        assert case["global_scalar"] == pytest.approx(energy, rel=1e-10), name

    disks, energy = random_disks(24, 11, phi=0.9, units="k"), 0.0
    for i, j in zip(*np.triu_indices(disks.n, 1), strict=True):
        r = disks.positions[j] - disks.positions[i]
        r -= np.rint(r @ np.linalg.inv(disks.box)) @ disks.box
        large = sorted((disks.diameters[[i, j]] > 1) + 1)
        overlap = max(0.0, disks.diameters[[i, j]].mean() - np.hypot(*r))
        energy += force_styles.STRENGTH[f"{large[0]} {large[1]}"] * overlap**2
    assert found["atomic-pair-disk_drag"]["init_vdwl"] == pytest.approx(energy, rel=1e-12)
