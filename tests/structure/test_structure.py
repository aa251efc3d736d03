"""g(r), S(k) and chi_V(k) against plain numpy, closed forms, freud, and what they must be of any packing."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import own_structure as own
import pandas as pd
import pytest
import reference_of_freud
import shapely
from scipy.special import j1

import jamlab

STATES = Path(__file__).parents[1] / "states"
K_MAX = 9.0
EDGES = np.array([0.0, 0.6, 0.9, 1.0, 1.17, 1.5, 2.0])


def disks(box, positions, diameters, **more):
    return jamlab.Packing("sp", box, positions, {"k": 1.0}, "k", np.broadcast_to(diameters, len(positions)), **more)


def at_random(n, box, diameters, seed=3):
    return disks(box, np.random.default_rng(seed).random((n, 2)) @ np.array(box), diameters)


def in_two_places(name):
    """Droplets of a file, and the same moved apart."""
    p = jamlab.read(STATES / name)
    apart = p.positions + 0.5 * p.centroids[p.particle]
    return p, p.with_state(positions=apart, box=1.5 * p.box)


@cache
def states():
    rng = np.random.default_rng(1)
    jammed, fixed = jamlab.pack(12, 1e-2, seed=1), np.arange(12) < 3
    far = jammed.positions + (rng.integers(-1000, 1000, (12, 2)) @ jammed.box)
    return {
        "jammed": jammed,
        "onset": jamlab.jam(10, seed=2),
        "dense": at_random(12, [[4.0, 0.0], [0.7, 3.0]], 0.9),
        "own images": disks([[0.9, 0.0], [0.3, 0.8]], [[0.1, 0.2]], 1.0),
        "thin": disks([[5.0, 0.0], [1.0, 0.7]], [[0.1, 0.2], [2.0, 0.3]], [0.6, 0.9]),
        "leaning": at_random(10, [[3.0, 0.0], [11.1, 4.0]], 0.8),
        "far": jammed.with_state(positions=far),
        "fixed": at_random(12, [[4.0, 0.0], [0.0, 4.0]], 0.7).with_state(fixed=fixed),
        "many sizes": at_random(40, [[6.0, 0.0], [2.0, 5.0]], rng.lognormal(0, 0.3, 40)),
        "wide": at_random(40, [[7.0, 0.0], [0.0, 6.0]], np.geomspace(0.2, 4.0, 40)),
    }


SOME = ("jammed", "onset", "dense", "own images", "thin", "leaning", "far", "fixed", "many sizes", "wide")


def off(found, wanted):
    assert found.shape == wanted.shape
    return np.abs(found - wanted).max() / np.abs(wanted).max()


@pytest.mark.parametrize("name", SOME)
def test_sums_of_waves_are_those_of_plain_numpy(name):
    p = states()[name]
    s, chi = jamlab.structure_factor(p, K_MAX), jamlab.spectral_density(p, K_MAX, "nominal")
    waves = own.wavevectors(p.box, K_MAX)
    assert np.abs(s.wavevectors - waves).max() < 1e-12 * K_MAX and np.array_equal(s.wavevectors, chi.wavevectors)
    assert off(s.values, own.structure_factor(p.centroids, p.box, K_MAX)) < 1e-10
    assert off(chi.values, own.spectrum_of_disks(p, K_MAX)) < 1e-10


@pytest.mark.parametrize("name", ["jammed", "onset", "dense", "own images", "thin", "leaning", "far", "fixed"])
def test_spectrum_of_the_union_is_that_of_the_arcs_of_plain_numpy(name):
    p = states()[name]
    assert off(jamlab.spectral_density(p, K_MAX).values, own.spectrum_of_union(p, K_MAX)) < 1e-10


@pytest.mark.parametrize("name", SOME)
def test_pairs_are_those_of_plain_numpy(name):
    p = states()[name]
    classes = None if len(np.unique(p.diameters)) < 5 else 2
    g = jamlab.pair_correlation(p, EDGES, classes)
    bound = np.median(p.diameters) if classes else np.mean(p.diameters) - 1e-6
    large = p.diameters > bound
    kinds = [~large, large] if (~large).any() else [large]
    assert len(g.sizes) == len(kinds) and g.shares == pytest.approx([kind.mean() for kind in kinds])
    for a, first in enumerate(kinds):
        for b, second in enumerate(kinds):
            wanted = own.pair_correlation(p.centroids, p.box, EDGES, first, second)
            assert g.partial[a, b] == pytest.approx(wanted, rel=1e-10)
    every = np.ones(p.n, dtype=bool)
    assert g.g == pytest.approx(own.pair_correlation(p.centroids, p.box, EDGES, every, every), rel=1e-10)
    assert np.array_equal(2 * g.pairs, own.pair_counts(p.centroids, p.box, EDGES, every, every))


@pytest.mark.parametrize("name", ["few_droplets.h5", "droplets_at_onset.h5"])
def test_droplets_apart_are_polygons_with_arcs_at_their_corners(name):
    apart = in_two_places(name)[1]
    assert off(jamlab.spectral_density(apart, 5.0).values, own.spectrum_of_convex_droplets(apart, 5.0)) < 1e-10
    g = jamlab.pair_correlation(apart, EDGES)
    large = apart.params["a0"] > apart.params["a0"].mean()
    kinds = [~large, large] if (~large).any() else [large]
    wanted = own.pair_correlation(apart.centroids, apart.box, EDGES, kinds[0], kinds[-1])
    assert g.partial[0, -1] == pytest.approx(wanted, rel=1e-10)
    assert g.sizes == pytest.approx([np.sqrt(apart.params["a0"][kind]).mean() for kind in kinds])


def test_droplets_that_touch_are_the_union_of_drawn_outlines():
    """Arcs of rims drawn by chords of 0.1 degrees, whose sagitta is 4e-7 of the rim."""
    p = in_two_places("compressed_droplets.h5")[0]
    w = 0.5 * p.params["delta"]
    moves = own.images(p.box, np.abs(p.box).sum())
    drawn = [shapely.Polygon(ring).buffer(w, quad_segs=900) for ring in np.split(p.positions, p.offsets[1:-1])]
    cell = shapely.Polygon([[0, 0], p.box[0], p.box.sum(axis=0), p.box[1]])
    moved = [shapely.affinity.translate(each, *move) for each in drawn for move in moves]
    union = shapely.unary_union([each.intersection(cell) for each in moved if each.intersects(cell)])
    waves, flux = own.wavevectors(p.box, 4.0), 0.0
    for part in getattr(union, "geoms", [union]):
        part = shapely.geometry.polygon.orient(part)
        for ring in (part.exterior, *part.interiors):
            points = np.array(ring.coords)
            edges, middles = np.diff(points, axis=0), 0.5 * (points[1:] + points[:-1])
            across = waves[:, :1] * edges[:, 1] - waves[:, 1:] * edges[:, 0]
            phase = np.sinc(waves @ edges.T / (2 * np.pi)) * np.exp(-1j * waves @ middles.T)
            flux = flux + (across * phase).sum(axis=1)
    wanted = np.abs(flux / np.sum(waves**2, axis=1)) ** 2 / p.area
    assert off(jamlab.spectral_density(p, 4.0).values, wanted) < 1e-6
    assert union.area / p.area == pytest.approx(jamlab.packing_fraction(p), rel=1e-6)


@pytest.mark.parametrize("method", ["exact", "nominal"])
@pytest.mark.parametrize("tilt", [0.0, 8.0])
def test_a_square_lattice_scatters_where_its_reciprocal_lattice_does(method, tilt):
    """chi_V = n (2 pi R J_1(kR)/k)^2/a^2 at reciprocal vectors of the lattice of side a, and 0 between."""
    places = np.array([[i, j] for i in range(4) for j in range(4)]) + np.array([0.3, 0.1])
    chi = jamlab.spectral_density(disks([[4.0, 0.0], [tilt, 4.0]], places, 0.9), 30.0, method)
    order = chi.wavevectors / (2 * np.pi)
    bragg = np.abs(order - np.rint(order)).max(axis=1) < 1e-9
    wanted = np.where(bragg, 16 * (2 * np.pi * 0.45 * j1(0.45 * chi.k) / chi.k) ** 2, 0.0)
    assert bragg.sum() == 34 and np.abs(chi.values - wanted).max() < 1e-12 * wanted.max()


def test_two_disks_that_overlap_share_a_lens():
    """Their transform is that of both less that of the lens, whose width at x from its chord is known."""
    p = disks([[6.0, 0.0], [0.0, 5.0]], [[2.0, 2.0], [2.7, 2.0]], 1.0)
    node, weight = np.polynomial.legendre.leggauss(400)
    turn = 0.5 * np.pi * (1 + node) / 2  # of x = half width times sin(turn), which smooths the tips
    k = own.wavevectors(p.box, K_MAX)
    half = np.sqrt(0.25 - 0.35**2)
    y = half * np.sin(turn)
    width = 2 * (np.sqrt(0.25 - y**2) - 0.35)
    terms = 2 * np.cos(k[:, 1:] * y) * width * np.sinc(k[:, :1] * width / (2 * np.pi)) * half * np.cos(turn)
    lens = terms @ weight * 0.25 * np.pi * np.exp(-1j * k @ [2.35, 2.0])
    size = np.hypot(*k.T)
    both = (np.exp(-1j * k @ p.positions.T).sum(axis=1)) * np.pi * j1(0.5 * size) / size
    assert off(jamlab.spectral_density(p, K_MAX).values, np.abs(both - lens) ** 2 / p.area) < 1e-10
    assert off(jamlab.spectral_density(p, K_MAX, "nominal").values, np.abs(both) ** 2 / p.area) < 1e-12


@pytest.mark.parametrize("name", list(reference_of_freud.BOXES))
def test_freud_counts_the_same_pairs_and_waves(name):
    """In single precision; a pair beside an edge may count on its other side."""
    box = np.array(reference_of_freud.BOXES[name])
    wanted = json.loads(reference_of_freud.FILE.read_text())[name]
    p = disks(box, reference_of_freud.positions(box), 1.0)
    edges = np.linspace(0.0, reference_of_freud.FARTHEST, reference_of_freud.BINS + 1)
    g = jamlab.pair_correlation(p, edges)
    one = 2 * box[0, 0] * box[1, 1] / (p.n**2 * np.pi * np.diff(edges**2))
    assert (np.abs(g.g - wanted["g"]) <= 1.01 * one).all() and np.sum(
        np.abs(g.g - wanted["g"]) > 1e-5 * g.g + 1e-5
    ) <= 2
    s = jamlab.structure_factor(p, reference_of_freud.LONGEST + 1)
    numbers = np.rint(s.wavevectors @ box.T / (2 * np.pi)).astype(int)
    ours = {tuple(n): (k, value) for n, k, value in zip(numbers.tolist(), s.k, s.values, strict=True)}
    at = np.array([ours[n] if n in ours else ours[-n[0], -n[1]] for n in map(tuple, wanted["numbers"]) if any(n)])
    shells = np.digitize(at[:, 0], wanted["edges"]) - 1
    seen = 0
    for shell in range(1, len(wanted["s"])):
        if (found := at[shells == shell, 1]).size and np.abs(at[:, :1] - wanted["edges"]).min() > 1e-5:
            assert found.mean() == pytest.approx(wanted["s"][shell], rel=2e-4)
            seen += 1
    assert seen > 10


def test_partial_correlations_of_many_packings_have_errors():
    packings = [jamlab.pack(16, 1e-2, seed) for seed in (1, 2, 3)]
    found = jamlab.pair_correlation(packings, EDGES)
    each = np.array([jamlab.pair_correlation(p, EDGES).g for p in packings])
    assert found.packings == 3 and found.g == pytest.approx(each.mean(axis=0), rel=0.02)  # areas differ by 1 %
    assert found.error == pytest.approx(each.std(axis=0, ddof=1) / np.sqrt(3), rel=0.1, abs=0.02)
    assert np.isnan(jamlab.pair_correlation(packings[0], EDGES).error).all()
    table = found.to_dataframe()
    assert list(table.columns) == ["r", "g", "error", "pairs", "g_0_0", "g_0_1", "g_1_1"]
    assert np.einsum("a,b,abm->m", found.shares, found.shares, found.partial) == pytest.approx(found.g)


def test_shells_weigh_wavevectors_alike():
    packings = [jamlab.pack(16, 1e-2, seed) for seed in (1, 2, 3)]
    s = jamlab.structure_factor(packings, 9.0)
    each = [jamlab.structure_factor(p, 9.0) for p in packings]
    assert np.array_equal(s.values, np.concatenate([one.values for one in each])) and s.packings == 3
    shells = s.shells([2.0, 5.0, 9.0])
    inside = [(s.k >= low) & (s.k < high) for low, high in ((2.0, 5.0), (5.0, 9.1))]
    assert shells.mean == pytest.approx([s.values[kept].mean() for kept in inside])
    assert shells.k == pytest.approx([s.k[kept].mean() for kept in inside])
    assert shells.wavevectors.tolist() == [kept.sum() for kept in inside]
    means = [[s.values[kept & (s.state == n)].mean() for n in range(3)] for kept in inside]
    assert shells.error == pytest.approx(np.std(means, axis=1, ddof=1) / np.sqrt(3), rel=0.15)
    one = each[0].shells([2.0, 5.0, 9.0])
    values = each[0].values[(each[0].k >= 2.0) & (each[0].k < 5.0)]
    assert one.error[0] == pytest.approx(values.std(ddof=1) / np.sqrt(len(values)))
    usual = s.shells()
    assert usual.wavevectors.sum() == s.shells(5).wavevectors.sum() == len(s.values)
    assert usual.k[0] == pytest.approx(s.width, rel=0.3)


def test_frames_of_a_flow_have_a_mean_and_states_of_a_sweep_none():
    run = jamlab.shear(jamlab.pack(12, 1e-2, seed=1), rate=1e-2, strain=0.02, snapshot_every=0.01)
    frames = list(run.frames)
    assert len(frames) > 1
    assert np.array_equal(jamlab.structure_factor(run, K_MAX).values, jamlab.structure_factor(frames, K_MAX).values)
    mean = jamlab.pair_correlation(frames, EDGES).g
    assert mean == pytest.approx(np.mean([jamlab.pair_correlation(p, EDGES).g for p in frames], axis=0))
    onset = jamlab.jam(8, seed=1)
    with pytest.raises(jamlab.InputError, match="kinds have no common mean"):
        jamlab.structure_factor([onset, *jamlab.compress(onset, to=0.9, step=0.05)], 9.0)


def test_the_spectrum_adds_up_to_the_variance_of_what_is_covered():
    """Sum over all k of chi_V/A = rho (1 - rho); chi_V falls as 2 l/(A k^3) by the length l of the boundary (Debye,
    Anderson & Brumberger 1957), so that l/(pi A k_max) is missing."""
    p = jamlab.pack(12, 1e-2, seed=1)
    chi = jamlab.spectral_density(p, 150.0)
    missing = jamlab.voids(p).perimeter.sum() / (np.pi * p.area * 150.0)
    rho = jamlab.packing_fraction(p)
    assert 2 * chi.values.sum() / p.area + missing == pytest.approx(rho * (1 - rho), rel=1e-3)


CALLS = {
    "k_max = 0.0": lambda p: jamlab.structure_factor(p, 0.0),
    "k_max = nan": lambda p: jamlab.spectral_density(p, float("nan")),
    "k_max = 0.1: the shortest wavevector": lambda p: jamlab.structure_factor(p, 0.1),
    "k_max = 100000: about": lambda p: jamlab.spectral_density(p, 1e5),
    "unknown method 'union': use one of exact, nominal": lambda p: jamlab.spectral_density(p, 9.0, "union"),
    "r = -1: must be a distance above 0": lambda p: jamlab.pair_correlation(p, -1.0),
    r"r = \[1. 1.\]: give the edges": lambda p: jamlab.pair_correlation(p, [1.0, 1.0]),
    r"r = 2e\+06: there are about": lambda p: jamlab.pair_correlation(p, [0.0, 2e6]),
    "size_classes = 7: must be a whole number from 1 to 2": lambda p: jamlab.pair_correlation(p, 2.0, 7),
    r"size_classes = \[9.0\]: class 1 has no particle": lambda p: jamlab.pair_correlation(p, 2.0, [9.0]),
    r"packings\[0\] has walls: chi_V": lambda p: jamlab.spectral_density(jamlab.with_walls(p, flat=True), 9.0),
    r"packings\[0\] and packings\[1\] are of the same packing": lambda p: jamlab.pair_correlation([p, p], 2.0),
    "packings: give one or more": lambda p: jamlab.structure_factor([], 9.0),
    "select: applies to a campaign": lambda p: jamlab.structure_factor(p, 9.0, select={"n": 8}),
    "bins = 0": lambda p: jamlab.structure_factor(p, 9.0).shells(0),
    r"bins from 50 to 60: the wavevectors are": lambda p: jamlab.structure_factor(p, 9.0).shells([50.0, 60.0]),
    r"bins = \[2. 1.\]": lambda p: jamlab.structure_factor(p, 9.0).shells([2.0, 1.0]),
}


@pytest.mark.parametrize("words", list(CALLS))
def test_bad_input_is_refused_by_value_and_remedy(words, sp_jammed):
    with pytest.raises(jamlab.InputError, match=words) as refused:
        CALLS[words](sp_jammed)
    said = str(refused.value)
    assert "\n" not in said and len(said) < 300


def test_droplets_have_no_undeformed_shape():
    p = in_two_places("few_droplets.h5")[0]
    with pytest.raises(jamlab.InputError, match="use 'exact'"):
        jamlab.spectral_density(p, 9.0, "nominal")


class OfTwoPressures:
    """What functions ask of a campaign: two states, each a task."""

    def __init__(self):
        self.states = {f"{p:g}": jamlab.pack(8, p, seed=1) for p in (1e-3, 1e-2)}

    def _rows_of(self, name):
        assert name == "states"
        same = {"state": 0, "converged": True, "seed": 1, "n": 8}
        return pd.DataFrame([same | {"task": task, "target_pressure": float(task)} for task in self.states])

    def packings(self, task):
        return [self.states[task]]


def test_a_campaign_is_averaged_over_its_packings():
    """States of one pressure are chosen by name."""
    campaign, chosen = OfTwoPressures(), {"target_pressure": 1e-3}
    p = campaign.states["0.001"]
    assert np.array_equal(
        jamlab.spectral_density(campaign, K_MAX, select=chosen).values, jamlab.spectral_density(p, K_MAX).values
    )
    assert np.array_equal(
        jamlab.pair_correlation(campaign, EDGES, select=chosen).g, jamlab.pair_correlation(p, EDGES).g
    )
    with pytest.raises(jamlab.InputError, match=r"2 kinds.*select="):
        jamlab.structure_factor(campaign, K_MAX)


def test_one_packing_needs_no_forces():
    """Two disks in one place, which have no contact force, scatter as one twice as strong."""
    box = [[2.0, 0.0], [0.3, 2.0]]
    one, two = disks(box, [[0.0, 0.0]], 1.0), disks(box, [[0.0, 0.0], [0.0, 0.0]], 1.0)
    assert jamlab.structure_factor(two, K_MAX).values == pytest.approx(2.0)
    assert jamlab.pair_correlation(two, [0.0, 1.0]).pairs.tolist() == [1]
    assert jamlab.spectral_density(two, K_MAX).values == pytest.approx(jamlab.spectral_density(one, K_MAX).values)
    twice = jamlab.spectral_density(two, K_MAX, "nominal").values
    assert twice == pytest.approx(4 * jamlab.spectral_density(one, K_MAX, "nominal").values)


@pytest.mark.parametrize("s", [1e-90, 2.0**-20, 1e90])
def test_any_unit_of_length(s):
    p = states()["jammed"]
    q = p.with_state(positions=s * p.positions, box=s * p.box, diameters=s * p.diameters)
    shells, usual = jamlab.spectral_density(q, K_MAX / s).shells(4), jamlab.spectral_density(p, K_MAX).shells(4)
    assert shells.mean / s**2 == pytest.approx(usual.mean, rel=1e-9)
    assert shells.error / s**2 == pytest.approx(usual.error, rel=1e-9)
    assert jamlab.pair_correlation(q, 2.0 * s).g.shape == jamlab.pair_correlation(p, 2.0).g.shape
