"""Dimers from a random start over onset and compression to moduli, a page, and a picture."""

from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.mechanics.stiffness import energy_terms, forces, stress


@pytest.fixture(scope="module")
def onset() -> jamlab.Packing:
    return jamlab.jam(8, "dimer", seed=1)


@pytest.fixture(scope="module")
def dense(onset: jamlab.Packing) -> jamlab.Packing:
    return list(jamlab.compress(onset, to=0.94, step=0.03))[-1]


def energy(packing: jamlab.Packing) -> float:
    return sum(float(term.energy.sum()) for term in energy_terms(packing))


def test_lammps_evaluates_the_same(dense: jamlab.Packing) -> None:
    moved = dense.with_state(positions=dense.positions + 0.02 * np.sin(37 * dense.positions))
    found = jamlab.evaluate(moved)
    assert found.energy == pytest.approx(energy(moved), rel=1e-12)
    assert np.abs(found.forces - forces(moved)).max() < 1e-12
    assert np.abs(found.stress - stress(moved)).max() < 1e-12


def test_forces_are_the_slope_of_the_energy(dense: jamlab.Packing) -> None:
    moved = dense.with_state(positions=dense.positions + 0.02 * np.sin(37 * dense.positions))
    way, step = np.random.default_rng(1).normal(size=moved.positions.shape), 1e-5
    ahead, behind = (energy(moved.with_state(positions=moved.positions + s * way)) for s in (step, -step))
    assert (behind - ahead) / (2 * step) == pytest.approx(np.vdot(forces(moved), way), rel=1e-6)


def test_onset_is_jammed_and_bonds_hold(onset: jamlab.Packing) -> None:
    length = np.hypot(*(onset.positions[1::2] - onset.positions[::2]).T)
    assert onset.converged and np.allclose(length, 0.5 * onset.diameters, rtol=1e-5)
    assert not jamlab.contacts(onset).unjammed


def test_area_is_that_of_two_disks_less_their_lens(dense: jamlab.Packing) -> None:
    side = np.arange(-1, 1, 2e-3) + 1e-3
    grid = side[:, None] + 1j * side
    inside = (abs(grid - 0.25) < 0.5) | (abs(grid + 0.25) < 0.5)
    assert dense.phi * dense.area == pytest.approx(4 * inside.mean() * np.sum(dense.disk_diameters**2), rel=1e-3)


def test_modulus_is_that_of_a_strained_box(dense: jamlab.Packing) -> None:
    linear, strained = (jamlab.shear_modulus(dense, method) for method in ("linear-response", "finite-strain"))
    assert dense.converged and linear == pytest.approx(strained, rel=1e-6)


def test_page_and_plot_show_them(onset: jamlab.Packing, dense: jamlab.Packing, tmp_path: Path) -> None:
    jamlab.write_page(tmp_path / "dimers.html", [onset, dense])
    assert "8 dimers" in (tmp_path / "dimers.html").read_text(encoding="utf-8")
    assert len(dense.plot().collections[0].get_paths()) >= dense.n
