"""Polygons that fold over themselves are found, in Python and in the plugin, and are no packing."""

import numpy as np
import pytest
import shapely

import jamlab
from jamlab.installed_files import installed
from jamlab.packing.outlines import self_crossings

from .test_plugin_on_ranks import launch

DECK = """
{variables}
variable dir index {decks}
variable data index whole.data
include {decks}/parts/dp
group far id {vertex}
displace_atoms far move {move[0]:.17g} {move[1]:.17g} 0
run 0
print "crossings $(v_crossed) $(c_shape[{polygon}][4])"
variable steps delete
variable steps index 0
variable strict index no
include {decks}/parts/minimum
print "went on"
"""


def bow_tie():
    """A square, and a quadrangle whose two long edges cross."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    crossed = np.array([[0.0, 0.0], [1.2, 1.0], [1.0, 0.0], [0.0, 1.5]]) + 2.0
    return np.vstack([square, crossed]), np.array([0, 4, 8])


def test_a_bow_tie_is_found_and_refused():
    """Its area is positive, so the order of its vertices alone does not tell."""
    positions, offsets = bow_tie()
    assert self_crossings(positions, offsets).tolist() == [1]
    law = {"gamma": 0.1, "ka": 1.0, "eps": 1.0, "delta": 0.1, "eta": 0.0, "contact": "outline", "a0": [1.0, 1.0]}
    with pytest.raises(jamlab.SelfCrossingError, match="polygon 1"):
        jamlab.Packing("dp", 5 * np.eye(2), positions, law, offsets=offsets)


@pytest.mark.parametrize("places", [1, 2])
def test_vertices_in_one_or_two_places_are_no_outline(places):
    corners = np.array([[0.0, 0.0], [1.0, 1.0]])[[0, places - 1, 0, 0]]
    positions = np.vstack([bow_tie()[0][:4], corners + 2.0])
    assert self_crossings(positions, np.array([0, 4, 8])).tolist() == [1]


@pytest.mark.parametrize("grid", [None, 3, 5])  # corners on a grid touch and overlap exactly
def test_random_outlines_are_judged_as_by_shapely(grid):
    rng = np.random.default_rng(grid)
    sizes = rng.integers(3, 10, 400)
    turn = np.concatenate([np.sort(rng.uniform(0, 2 * np.pi, size)) for size in sizes])
    turn += rng.normal(0, 0.2, len(turn))
    corners = rng.uniform(0.5, 1.5, (len(turn), 1)) * np.column_stack([np.cos(turn), np.sin(turn)])
    if grid:
        corners = np.round(grid * corners) / grid
        corners[np.cumsum(sizes) - 1] += 1e-3  # no outline shrinks to a line
    offsets = np.cumsum([0, *sizes])
    rings = shapely.linearrings(corners, indices=np.repeat(np.arange(len(sizes)), sizes))
    valid = shapely.is_valid(shapely.polygons(rings))
    assert 0.1 < valid.mean() < 0.9
    valid |= shapely.is_valid(shapely.remove_repeated_points(shapely.polygons(rings), 1e-12 * np.ptp(corners)))
    assert self_crossings(corners, offsets).tolist() == np.flatnonzero(~valid).tolist()


@pytest.mark.parametrize("vertices", [3, 17, 400, 3000])
def test_simple_outlines_of_any_size(vertices):
    turn = 2 * np.pi * np.arange(vertices) / vertices
    star = (1 + 0.3 * np.cos(vertices // 3 * turn))[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    assert not len(self_crossings(star, np.array([0, vertices])))
    star[[0, vertices // 2]] = star[[vertices // 2, 0]]
    crossed = self_crossings(star, np.array([0, vertices])).tolist()
    assert crossed == ([0] if vertices > 3 else [])


def test_a_packing_driven_to_collapse_is_found(random_polygons):
    """Boxes far too small: the plugin counts crossing edges of the very polygons that shapely finds."""
    p = random_polygons(0.0, "outline", 1)
    for shrink in (1.0, 0.85, 0.7):
        with jamlab.Session(p.with_state(positions=p.positions * shrink, box=p.box * shrink)) as session:
            session.minimize(1e-6, minimizer="fire", steps=1000)
            found = session.self_crossings()
            session.command("compute shape all polygon")
            session.command("run 0")
            crossings = session._lmp.numpy.extract_compute("shape", 0, 2)[:, 3]
            assert np.flatnonzero(crossings).tolist() == found.tolist()
            assert len(found) == {1.0: 0, 0.85: 1, 0.7: 2}[shrink]
            if len(found):
                with pytest.raises(jamlab.SelfCrossingError, match=f"polygon {found[0]} "):
                    session.packing()


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("through", [False, True])
def test_the_decks_stop_at_a_polygon_that_crosses_itself(random_polygons, tmp_path, ranks, through):
    """One vertex pushed out through the opposite side; the polygon lies across the boundaries of box and ranks."""
    p = random_polygons(0.3, "outline", 1)
    ring = slice(*p.offsets[3:5])
    vertex = p.offsets[3] + 2
    other = p.positions.copy()
    other[vertex] += (1.15 if through else -0.1) * 2 * (p.positions[ring].mean(axis=0) - other[vertex])
    assert self_crossings(other, p.offsets).tolist() == ([3] if through else [])
    wide = p.with_state(box=2 * p.box)
    for place in (0.0, 0.5):  # centred on the corner of the box, or where ranks meet
        moved = p.positions - p.positions[ring].mean(axis=0) + place * wide.box.sum(axis=0)
        jamlab.write(tmp_path / "whole.data", wide.with_state(positions=moved))
        values = {key: value for key, value in p.params.items() if key != "a0"} | {"skin": 0.1, "longest_edge": 3.0}
        variables = "\n".join(f"variable {key} index {value}" for key, value in values.items())
        fields = {"decks": installed("lammps_inputs"), "variables": variables, "vertex": vertex + 1, "polygon": 4}
        deck = DECK.format(**fields, move=other[vertex] - p.positions[vertex])
        code, output = launch(tmp_path, deck, ranks)
        counts = next(row.split()[1:] for row in output.splitlines() if row.startswith("crossings"))
        assert counts[0] == counts[1]
        assert (int(counts[0]) > 0) == through
        assert code == (2 if through else 0)
        assert (tmp_path / "dp.failed.data").exists() == through
        assert ("SELF-CROSSING" in output) == through
        assert ("went on" in output) != through
