"""Density of states and participation against lattice sums, closed forms and counting."""

from dataclasses import replace

import numpy as np
import pytest

import jamlab
from jamlab.mechanics import vibrations
from jamlab.results import Modes

SPACING = 0.95  # of unit disks in a triangular lattice


def triangular(cells):
    i, j = np.divmod(np.arange(cells * cells), cells)
    places = SPACING * np.column_stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j])
    box = SPACING * np.diag([cells, cells * np.sqrt(0.75)])
    return jamlab.Packing("sp", box, places, {"k": 1.0}, "k", np.ones(cells * cells))


@pytest.fixture(scope="module")
def crystal():
    """400 disks, and all of their modes without pre-stress."""
    packing = triangular(20)
    return packing, jamlab.lowest_modes(packing, None, prestress=False)


@pytest.fixture(scope="module")
def packings():
    return [jamlab.pack(32, 1e-3, seed) for seed in (1, 2, 3)]


def by_hand(vectors, particle, size=None):
    """Modes that are given by their vectors."""
    vectors = np.asarray(vectors, float)
    return Modes(np.arange(1.0, 1 + len(vectors)), vectors, np.asarray(particle), size or len(vectors), 1e-9)


def test_modes_of_a_crystal_are_those_of_its_dynamical_matrices(crystal):
    """Springs along three directions: D(k) = sum of 2 (1 - cos k.r) n n over all waves of the box."""
    found = crystal[1]
    x, y = np.meshgrid(np.arange(20), np.arange(20))
    waves = 2 * np.pi / (20 * SPACING) * np.column_stack([x.ravel(), y.ravel() / np.sqrt(0.75)])
    along = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)], [-0.5, np.sqrt(0.75)]])
    phases = 2 * (1 - np.cos(SPACING * waves @ along.T))
    exact = np.sort(np.linalg.eigvalsh(np.einsum("kc,ci,cj->kij", phases, along, along)).ravel())
    assert found.eigenvalues == pytest.approx(exact, abs=1e-12)
    assert found.zero.tolist() == [True] * 2 + [False] * 798


def test_low_frequencies_follow_the_law_of_debye(crystal):
    """D = A omega/(2 pi)/(2 N) (1/c_T^2 + 1/c_L^2) of sound at the moduli of the lattice, to a tenth: waves are few."""
    packing, modes = crystal
    shear, bulk = np.sqrt(3) / 4, np.sqrt(3) / 2
    slow, fast = shear * packing.area / packing.n, (shear + bulk) * packing.area / packing.n
    found = modes.density([0.0, 0.5, 0.7])
    debye = packing.area * found.omega / (4 * np.pi * packing.n) * (1 / slow + 1 / fast)
    assert found.density == pytest.approx(debye, rel=0.12)


def test_participation_of_known_motions():
    """One particle 1/N, a translation 1, a transverse wave 2/3; two of four particles 1/2."""
    n, where = 24, 2 * np.pi * np.arange(24) / 24
    one, all_of_them, wave = np.zeros((n, 2)), np.full((n, 2), [0.6, 0.8]), np.column_stack([0 * where, np.sin(where)])
    one[5] = [0.3, -0.4]
    found = by_hand([one, all_of_them, wave], np.arange(n))
    assert found.participation == pytest.approx([1 / n, 1.0, 2 / 3], rel=1e-12)
    half = np.array([[1.0, 0], [0, 1.0], [0, 0], [0, 0]])
    assert by_hand([half], np.arange(4)).participation == pytest.approx([0.5], rel=1e-12)


def test_a_droplet_takes_part_as_one_particle():
    """Two droplets of 3 and 5 vertices: one vertex alone, and both droplets with as much motion each."""
    particle = np.repeat([0, 1], [3, 5])
    vertex = np.zeros((8, 2))
    vertex[6] = [1.0, 2.0]
    both = np.column_stack([np.where(particle == 0, np.sqrt(1 / 3), np.sqrt(1 / 5)), np.zeros(8)])
    assert by_hand([vertex, both], particle).participation == pytest.approx([0.5, 1.0], rel=1e-12)


def test_the_integral_counts_modes(packings):
    """Every mode is in a bin, a zero mode or unstable; the interval is over packings, which weigh alike."""
    edges = np.linspace(0, 3, 13)
    found = jamlab.density_of_states(packings, edges)
    parts = [jamlab.lowest_modes(p, None).density(edges) for p in packings]
    assert found.packings == 3
    assert found.density == pytest.approx(np.mean([each.density for each in parts], axis=0), rel=1e-12)
    assert np.sum(found.density * np.diff(edges)) + found.zero_modes + found.unstable == pytest.approx(1, abs=1e-12)
    assert np.mean([jamlab.count_zero_modes(p) for p in packings]) / 64 == pytest.approx(found.zero_modes, abs=1e-12)
    assert np.all(found.density_low <= found.density) and np.all(found.density <= found.density_high)
    assert np.any(found.density_low < found.density_high) and np.isnan(parts[0].density_low).all()


def test_rattlers_take_their_zero_modes_along(packings):
    """Without them two translations remain; what the others do is the same, over fewer degrees of freedom."""
    one = next(p for p in packings if jamlab.contacts(p).rattlers.any())
    count = int(jamlab.contacts(one).rattlers.sum())
    whole, backbone = (jamlab.density_of_states(one, [0.0, 1.0, 3.0], rattlers=rattlers) for rattlers in (True, False))
    assert whole.zero_modes * 64 == pytest.approx(2 + 2 * count)
    assert backbone.zero_modes * (64 - 2 * count) == pytest.approx(2)
    assert backbone.density * (64 - 2 * count) == pytest.approx(whole.density * 64, rel=1e-9)


def test_unstable_modes_are_counted_apart(random_disks):
    p = random_disks(n=30, phi=1.0)
    values = np.linalg.eigvalsh(jamlab.hessian(p).toarray())
    found = jamlab.density_of_states(p, 10)
    assert found.unstable == pytest.approx(np.mean(values < -1e-6)) and found.unstable > 0


def test_impossible_densities_are_refused(packings):
    few = jamlab.lowest_modes(packings[0], 20)
    assert few.density(5).edges[-1] == pytest.approx(few.frequencies[-1])
    for bins, named in (
        ([0.0, 3.0], "take all"),
        ([1.0], "edges"),
        ([2.0, 1.0], "edges"),
        (0, "bins = 0"),
        (3.5, "bins = 3.5"),
    ):
        with pytest.raises(jamlab.InputError, match=named):
            few.density(bins)
    with pytest.raises(jamlab.InputError, match="2 kinds"):
        jamlab.density_of_states([packings[0], jamlab.pack(32, 1e-2, 1)])
    with pytest.raises(jamlab.InputError, match="one or more"):
        jamlab.density_of_states([])
    with pytest.raises(jamlab.InputError, match="no mode"):
        jamlab.lowest_modes(packings[0], 1).density()


def test_a_campaign_has_the_density_of_its_packings(full):
    """States of one pressure are chosen by name."""
    task = full.finished("sheared")[0]
    p = min(full.packings(task), key=lambda p: p.provenance["pressure"])
    found = jamlab.density_of_states(full, 6, select={"n": 32, "target_pressure": 1e-3})
    assert np.array_equal(found.density, jamlab.density_of_states(p, 6).density) and found.packings == 1
    for select, named in (({"n": 32}, "2 kinds.*select="), ({"n": 31}, "no row has n"), (None, "more. Choose")):
        with pytest.raises(jamlab.InputError, match=named):
            jamlab.density_of_states(full, select=select)
    with pytest.raises(jamlab.InputError, match="select"):
        jamlab.density_of_states(p, select={"n": 32})


def test_dense_matrices_have_a_limit(packings, monkeypatch):
    """Few modes of a packing are found by iteration, whatever its size."""
    monkeypatch.setattr(vibrations, "ITERATION", replace(vibrations.ITERATION, most=50))
    with pytest.raises(jamlab.InputError, match=r"64 modes of 64 coordinates.*at most 50.*count = 16"):
        jamlab.lowest_modes(packings[0], None)


@pytest.mark.slow
def test_the_plateau_of_soft_modes_begins_at_the_excess_of_contacts():
    """omega* ~ z - z_iso without pre-stress (Silbert, Liu & Nagel, PRL 95, 098301 (2005)): the slope in logarithms is 1
    to a tenth. omega* is where the count of modes between a tenth and three tenths, a straight line, would be 0."""
    excess, start = [], []
    for pressure in (0.1, 1e-2, 1e-3):
        several = [jamlab.pack(256, pressure, seed) for seed in (1, 2, 3, 4)]
        edges = np.linspace(0, 3.5, 701)
        found = jamlab.density_of_states(several, edges, rattlers=False, prestress=False)
        count = np.concatenate([[0], np.cumsum(found.density * np.diff(edges))])
        tenth, three = np.interp([0.1, 0.3], count, edges)
        start.append(tenth - 0.5 * (three - tenth))
        excess.append(np.mean([jamlab.contacts(p).z - 4 + 4 / jamlab.contacts(p).n_backbone for p in several]))
    assert np.polyfit(np.log(excess), np.log(start), 1)[0] == pytest.approx(1.0, abs=0.1)
    assert np.polyfit(excess, start, 1)[0] == pytest.approx(0.3, abs=0.1)


def test_the_picture_has_the_interval(packings):
    axes = jamlab.density_of_states(packings, 5).plot()
    assert axes.get_xlabel().endswith(r"[$\sqrt{k/m}$]") and axes.collections
    assert "3 packings" in axes.get_legend().get_texts()[0].get_text()
