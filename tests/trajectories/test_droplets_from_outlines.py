"""Droplets from outlines: the same packing back, areas at rest, equal edges, rims, files, and what is refused."""

import json

import numpy as np
import pandas as pd
import pytest
import shapely
from commands import call

import jamlab
from jamlab.geometry.equal_edges import equal_edges
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.models.droplets import free_area, free_polygon_area

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])


@pytest.fixture(scope="module")
def dense():
    """Eight compressed droplets, in a tilted cell of the same lattice."""
    *_, p = jamlab.compress(jamlab.jam(n=8, model="dp", seed=1), to=0.93, step=0.09)
    return p.with_state(box=np.array([[1, 0], [1, 1]]) @ p.box, max_force=p.max_force, converged=True)


def rings(packing):
    return np.split(packing.positions, packing.offsets[1:-1])


FORMS = {  # of the same outlines
    "plain": lambda ring, box: ring,
    "clockwise": lambda ring, box: np.roll(ring[::-1], 1, axis=0),
    "closed": lambda ring, box: np.vstack([ring, ring[:1]]),
    "doubled": lambda ring, box: np.repeat(ring, 2, axis=0),
    "shapely": lambda ring, box: shapely.Polygon(ring),
    "cut": lambda ring, box: np.mod(ring @ np.linalg.inv(box), 1.0) @ box,
}


@pytest.mark.parametrize("form", FORMS)
def test_outlines_of_droplets_give_the_packing_back(dense, form):
    """In any unit of length, and with the forces of its minimum."""
    scale = 7.3
    outlines = [FORMS[form](ring, dense.box) * scale if form != "shapely" else ring for ring in rings(dense)]
    if form == "shapely":
        outlines = [shapely.Polygon(ring * scale) for ring in outlines]
    areas = dense.params["a0"] * scale**2
    p = jamlab.droplets_from_outlines(outlines, dense.box * scale, rest_areas=areas, wrapped=form == "cut")
    shift = (p.positions - dense.positions) @ np.linalg.inv(dense.box)
    np.testing.assert_allclose(shift, np.rint(shift[p.offsets[:-1]])[p.particle], atol=1e-12)
    assert form == "cut" or np.abs(shift).max() < 1e-12
    np.testing.assert_allclose(p.params["a0"], dense.params["a0"], rtol=1e-14)
    assert jamlab.evaluate(p).energy == pytest.approx(jamlab.evaluate(dense).energy, rel=1e-12)
    assert np.abs(jamlab.evaluate(p).forces).max() < 1e-9
    assert jamlab.contacts(p).n_contacts == jamlab.contacts(dense).n_contacts


@pytest.mark.parametrize("law", [{}, {"gamma": 3.0}, {"gamma": 0.0}], ids=str)
def test_a_droplet_that_nothing_touches_has_the_given_area(law):
    """Independent minimum of gamma p + ka (a - a0)^2/2 over regular polygons; l is the mean root of a0."""
    centres = np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]])
    outlines, areas = [SQUARE * [2.0, 1.0] + c for c in centres], np.array([6.0, 8.0, 11.0])
    for rims in (False, True):
        p = jamlab.droplets_from_outlines(outlines, [20, 20], free_areas=areas, vertices=16, rims=rims, law=law)
        assert np.sqrt(p.params["a0"]).mean() == pytest.approx(1.0, rel=1e-12)
        unit, nv = p.box[0, 0] / 20, np.full(3, 16)
        own = free_area(nv, p.params) if rims else free_polygon_area(nv, p.params)
        np.testing.assert_allclose(own / unit**2, areas, rtol=1e-11)
        a, c = free_polygon_area(nv, p.params), 16 * np.tan(np.pi / 16)
        balance = p.params["gamma"] * np.sqrt(c / a) + p.params["ka"] * (a - p.params["a0"])
        np.testing.assert_allclose(balance, 0.0, atol=1e-10 * p.params["ka"])
    plain = jamlab.droplets_from_outlines(outlines, [20, 20], law=law)  # whose free areas are those of the outlines
    np.testing.assert_allclose(free_polygon_area(np.full(3, 4), plain.params), plain.polygons.areas, rtol=1e-11)


def test_relaxed_it_has_it_too():
    p = jamlab.relax(jamlab.droplets_from_outlines([SQUARE * [3.0, 1.0]], [20, 20], vertices=20))
    assert p.polygons.areas[0] * (20 / p.box[0, 0]) ** 2 == pytest.approx(12.0, rel=1e-9)
    assert np.ptp(np.hypot(*p.polygons.edges.T)) < 1e-7


def test_edges_become_equally_long_and_keep_the_area():
    turn = 2 * np.pi * np.arange(500) / 500
    circle = 3.0 * np.column_stack([np.cos(turn), np.sin(turn)]) + [5.0, -2.0]
    regular = equal_edges(circle, 12)
    radius = np.sqrt(area(circle) / (6 * np.sin(np.pi / 6)))
    np.testing.assert_allclose(np.hypot(*(regular - [5.0, -2.0]).T), radius, rtol=1e-4)
    np.testing.assert_allclose(equal_edges(regular, 12), regular, atol=1e-8)  # they are already
    bent = circle[::3] * (1 + 0.3 * np.cos(3 * turn[::3]))[:, None]
    for ring in (SQUARE * [5.0, 1.0], bent):
        found = equal_edges(ring, 23)
        lengths = np.hypot(*(np.roll(found, -1, axis=0) - found).T)
        assert np.ptp(lengths) < 1e-4 * lengths.mean() and area(found) == pytest.approx(area(ring), rel=1e-12)
        assert shapely.Polygon(found).symmetric_difference(shapely.Polygon(ring)).area < 0.1 * area(ring)


def area(ring):
    x, y = ring.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def honeycomb():
    """Four hexagons that fill the plane, and their box."""
    turn = np.pi / 6 + np.pi / 3 * np.arange(6)
    hexagon, side = np.column_stack([np.cos(turn), np.sin(turn)]), np.sqrt(3)
    centres = [(0.0, 0.0), (side, 0.0), (side / 2, 1.5), (1.5 * side, 1.5)]
    return [hexagon + c for c in centres], [2 * side, 3.0]


def test_outlines_of_rims_are_drawn_in_by_half_their_width():
    """Cells without gaps: the rims just touch, and free droplets with rims fill the box."""
    cells, box = honeycomb()
    p = jamlab.droplets_from_outlines(cells, box, rims=True, vertices=6, law={"delta": 0.2})
    assert p.phi == pytest.approx(1.0, rel=1e-12)
    near = vertex_contacts(p.with_state(params=p.params | {"delta": 0.2 + 1e-6}))
    assert len(near.distance) and near.distance.min() == pytest.approx(0.2, rel=1e-9)
    round_ = jamlab.droplets_from_outlines(cells, box, rims=True)
    assert np.diff(round_.offsets).tolist() == [14] * 4 and jamlab.relax(round_).converged
    with pytest.raises(jamlab.InputError, match=r"polygons 0 and \d (touch|cross).*rims=True"):
        jamlab.droplets_from_outlines(cells, box)
    with pytest.warns(jamlab.JamlabWarning, match=r"overlap by more than half.*rims=True"):
        jamlab.droplets_from_outlines([np.asarray(c) * 0.99 + 0.01 * np.mean(c, axis=0) for c in cells], box)


@pytest.mark.parametrize(
    ("outlines", "how", "words"),
    [
        ([], {}, "one or more"),
        ([SQUARE[:2]], {}, r"outlines\[0\] has 2 vertices"),
        ([SQUARE, np.repeat(SQUARE[:2], 2, axis=0) + 4], {}, r"outlines\[1\] has 2 vertices"),
        ([[[0, 0], [1, np.nan], [1, 1]]], {}, r"outlines\[0\]\[1, 1\] is nan"),
        ([np.ma.masked_array(SQUARE, SQUARE > 1)], {}, r"outlines\[0\] has masked entries"),
        ([SQUARE[:, :1]], {}, r"outlines\[0\] must have shape"),
        ([SQUARE[[0, 2, 1, 3]]], {}, r"outlines\[0\] crosses itself.*wrapped=True"),
        ([[[0, 0], [1, 0], [2, 0]]], {}, "folds back"),
        ([SQUARE, SQUARE + 1], {}, "polygons 0 and 1 cross.*rims=True.*wrapped=True"),
        ([SQUARE, SQUARE + np.array([2, 0])], {"rest_areas": [4.0, 4.0]}, "polygons 0 and 1 touch.*rims=True"),
        ([SQUARE, SQUARE + 0.1], {"rims": True, "law": {"delta": 0.01}, "vertices": 4}, "0 and 1 cross.*separate them"),
        ([SQUARE], {"rest_areas": [0.0]}, r"rest_areas\[0\] has area 0"),
        ([SQUARE], {"free_areas": [1.0, 2.0]}, r"free_areas must have shape \(1\)"),
        ([SQUARE], {"free_areas": [1.0], "rest_areas": [1.0]}, "give one of them"),
        ([SQUARE], {"vertices": 2}, "vertices = 2"),
        ([SQUARE], {"vertices": [8, 9]}, "vertices hold 2 numbers for n = 1"),
        ([SQUARE], {"law": {"weight": 1.0}}, "no parameter 'weight'"),
        ([SQUARE], {"law": {"nv_small": 8}}, "nv_small = 8"),
        ([SQUARE], {"law": {"gamma": 1e4}}, "gamma"),
        ([SQUARE], {"rims": True, "law": {"delta": 3.0}}, "delta = 3"),
        ([shapely.Polygon(SQUARE, [SQUARE / 2 + 0.5])], {}, "hole"),
        ([shapely.MultiPoint([(0, 0), (1, 1)])], {}, "is a MultiPoint"),
        ([[[0, 4.5], [3, 4.5], [6, 4.5]]], {"wrapped": True}, "wrap around the periodic box"),
    ],
)  # fmt: skip
def test_what_makes_no_droplets_is_refused(outlines, how, words):
    with pytest.raises(jamlab.InputError, match=words) as caught:
        jamlab.droplets_from_outlines(outlines, [9.0, 9.0], **how)
    assert "\n" not in str(caught.value)


def test_the_shell_reads_tables_and_geojson(dense, tmp_path):
    box = ",".join(f"{x:.17g}" for x in dense.box.ravel())
    cut = np.mod(dense.positions @ np.linalg.inv(dense.box), 1.0) @ dense.box
    table = pd.DataFrame(cut, columns=["X", "Y"]).assign(rest_area=dense.params["a0"][dense.particle])
    table.assign(Cell=[f"c{m}" for m in dense.particle]).to_csv(tmp_path / "d.csv", index=False)
    geometries = [json.loads(shapely.to_geojson(shape)) for shape in dense.polygons.shapes()]
    shapes = [{"type": "Feature", "properties": {}, "geometry": each} for each in geometries]
    (tmp_path / "d.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": shapes}))
    done = call(tmp_path, "droplets", "d.csv", "--box", box, "--wrapped", "--out", "d.h5")
    assert done.exit_code == 0, done.stderr
    found = jamlab.read(tmp_path / "d.h5")
    assert jamlab.evaluate(found).energy == pytest.approx(jamlab.evaluate(dense).energy, rel=1e-10)
    line = f"droplets d.geojson --box {box} --vertices 14 --law gamma=0.1 --out g.h5"
    again = call(tmp_path, *line.split())
    assert again.exit_code == 0, again.stderr
    other = jamlab.read(tmp_path / "g.h5")
    assert np.diff(other.offsets).tolist() == [14] * 8 and other.params["gamma"] == 0.1
    share = dense.polygons.areas.sum() / dense.area
    assert other.polygons.areas.sum() / other.area == pytest.approx(share, rel=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("droplet,x\n1,2\n", "x, y and one of"),
        ("id,x,y\n1,2,\n1,a,2\n", "droplet 1: could not convert"),
        ("id,x,y,free_area\n1,0,0,2\n1,1,0,2\n1,1,1,3\n", "free_area of 1 is 2 and 3"),
        ("id,x,y\n1,2\n1,3,2,3\n", "row 1 has 2 columns, 3 expected"),
        ('{"a": 1}', "no GeoJSON"),
    ],
)
def test_files_without_outlines_are_refused_by_name(tmp_path, text, words):
    path = tmp_path / ("d.geojson" if text[:1] == "{" else "d.csv")
    path.write_text(text)
    done = call(tmp_path, "droplets", path.name, "--box", "4,4")
    assert done.exit_code == 1 and words in done.stderr and path.name in done.stderr and done.stderr.count("\n") == 1
