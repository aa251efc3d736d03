"""Standard numbers of jamming, and droplets where foam physics is exact."""

import numpy as np
import pytest

import jamlab
from studies.beyond import foams, jamming
from studies.beyond.foams import DRY, LAW, crystal, dry_skeleton, rounded_hexagons
from studies.beyond.jamming import FORCES, FREQUENCIES, cutoff, tail_exponent, unjamming_fraction
from studies.reference_data import reference_tables


def test_small_values_that_follow_a_power_have_its_exponent():
    """Values v with a share (v/10)^e below: by their quantiles, in every window."""
    for exponent in (0.6, 1.0, 1.4):
        values = 10.0 * ((np.arange(200_000) + 0.5) / 200_000) ** (1 / exponent)
        counts = np.histogram(values, FORCES)[0][None]
        assert tail_exponent(FORCES, counts, -1.7, -0.4) == pytest.approx(exponent, abs=5e-3)
    assert np.isnan(tail_exponent(FORCES, np.zeros((3, 60)), -1.0, 0.0))


def test_omega_star_is_where_the_plateau_falls_to_half():
    omega, width = np.sqrt(FREQUENCIES[1:] * FREQUENCIES[:-1]), np.diff(FREQUENCIES)
    shape = np.where(omega < 2.7, 1 / (1 + (0.05 / omega) ** 4), 0.0)
    plateau = 1 / (shape @ width)
    assert plateau > 0.36
    expected = 0.05 * (plateau / 0.18 - 1) ** -0.25
    assert cutoff((1e6 * shape * width)[None]) == pytest.approx(expected, rel=0.02)
    assert np.isnan(cutoff((1e6 * (omega < 2.7) * width)[None]))  # a plateau without an end


@pytest.mark.parametrize("lowest", [1e-6, 1e-4])  # far from onset the last step counts
def test_a_packing_is_decompressed_to_its_own_onset(monkeypatch, lowest):
    monkeypatch.setattr(jamming, "_LOWEST", lowest)
    onset = jamlab.jam(n=16, seed=1)
    (dense,) = jamlab.compress(onset, onset.phi + 1e-3, 1e-3, by="phi")
    assert unjamming_fraction(dense) == pytest.approx(onset.phi, abs=max(1e-6, 0.2 * lowest))


@pytest.mark.parametrize("study", jamming.STUDIES, ids=lambda s: s.name)
def test_tables_that_ship_are_drawn(study):
    shown = study.draw(reference_tables())
    assert shown.caption and {c.figure for c in shown.claims} <= {study.name}
    assert all(np.isfinite(number["value"]) for number in shown.numbers.values())
    assert set(reference_tables().read(study.name)["task"]) <= set(study.tasks)


# foams ----------------------------------------------------------------------------------------------------------------


def test_pressure_is_the_derivative_of_the_outline_and_g_tends_to_that_of_the_dry_foam(monkeypatch):
    cell, step = np.array([1.08, 1.1, 1.15]), 1e-6
    lengths = [rounded_hexagons(cell + s, np.ones(3))[0] for s in (step, -step)]
    _, pressure, _ = rounded_hexagons(cell, np.ones(3))
    assert pressure == pytest.approx(-LAW["gamma"] * (lengths[0] - lengths[1]) / (2 * step), rel=1e-6)
    monkeypatch.setitem(LAW, "delta", 1e-9)
    assert rounded_hexagons(cell, np.ones(3))[2] * np.sqrt(cell / np.pi) / LAW["gamma"] == pytest.approx(DRY, rel=1e-6)


def test_g_is_that_of_a_sheared_steiner_tree():
    """Three films at 120 degrees over the triangle of neighbours, whose length has a closed form."""
    side, strain = 1.0, 1e-3
    corners = side * np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])

    def length(g):
        moved = corners + g * np.column_stack([corners[:, 1], np.zeros(3)])
        sides = np.sum((moved - np.roll(moved, 1, axis=0)) ** 2)
        return np.sqrt(0.5 * sides + 2 * np.sqrt(3) * 0.5 * side**2 * np.sqrt(0.75))

    cell = side**2 * np.sqrt(0.75)
    g = (length(strain) - 2 * length(0.0) + length(-strain)) / strain**2 / cell * 2  # two outlines a film
    assert g / np.sqrt(np.pi / cell) == pytest.approx(DRY, rel=1e-5)


def test_a_crystal_of_droplets_meets_the_exact_foam():
    *_, last = foams.measure_crystal(18)
    length, _, g = rounded_hexagons(np.array([last["cell"]]), np.array([last["area"]]))
    assert last["length"] == pytest.approx(length[0], rel=3e-3) and last["g"] == pytest.approx(g[0], rel=3e-3)
    numbers = foams.draw_crystal(reference_tables()).numbers
    assert numbers["relative error of G, vertices = 72"]["value"] < 2e-4
    for what in ("length of outlines", "pressure"):
        few, many = (numbers[f"relative error of {what}, vertices = {v}"]["value"] for v in (24, 48))
        assert few / many == pytest.approx(4, rel=0.15)  # facets: the square of the angle between edges


def test_films_of_droplets_are_continued_to_a_foam(monkeypatch):
    (state,) = jamlab.compress(crystal(18, 0.905), 0.95, 0.1)
    places, films, cells = dry_skeleton(state)
    assert (len(places), len(films), len(cells)) == (8, 12, 4)  # v - e + f = 0 on a torus
    assert sorted(abs(k) for cell in cells for k in cell) == sorted([*range(1, 13)] * 2)
    ends = np.array([[places[e] + wrap @ state.box - places[s]] for s, e, wrap in films.values()])[:, 0]
    cell = state.area / 4
    assert np.hypot(*ends.T) == pytest.approx(np.sqrt(2 * cell / 3**1.5), rel=1e-3)
    monkeypatch.setattr(foams, "which", lambda name: None)
    with pytest.raises(jamlab.InputError):
        foams.relax_by_evolver(state, np.ones(4), np.ones(12))


def test_disordered_droplets_meet_another_code():
    rows, numbers = reference_tables().read("beyond-droplet-foam"), foams.draw_foam(reference_tables()).numbers
    assert set(rows["what"]) == {"area of all cells", "G", "length", "pressure"}
    assert max(n["value"] for n in numbers.values()) < 0.02
