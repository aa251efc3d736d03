"""Pictures of packings, voids, cells and overlaps: what is drawn where; and the page on drawing results."""

import numpy as np
import pytest
import shapely
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

import jamlab
from jamlab.figures.save_picture import save_picture
from jamlab.geometry.voids.voids import void_paths, voids
from jamlab.models.droplets import regular_polygon
from jamlab.packing.packing import Packing

BOX = np.diag([4.0, 4.0])


def drawn(packing):
    return jamlab.contacts(packing).plot(packing.plot(Figure().subplots()))


def fills(axes):
    """Paths of all that is filled."""
    return [path for part in axes.collections if isinstance(part, PolyCollection) for path in part.get_paths()]


def lines(axes):
    """Straight lines of two ends: those between particles in contact."""
    segments = [s for part in axes.collections if isinstance(part, LineCollection) for s in part.get_segments()]
    return [segment for segment in segments if len(segment) == 2]


def test_particles_repeat_in_every_periodic_image():
    packing = jamlab.Packing("sp", BOX, [[0.1, 2.0], [2.0, 2.0]], {"eps": 1.0}, diameters=[1.0, 1.4])
    centres = np.array([path.vertices[:-1].mean(axis=0) for path in fills(drawn(packing))])
    cells = 4.0 * np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2)
    wanted = (packing.positions[:, None] + cells).reshape(-1, 2)
    assert len(centres) == len(wanted) == 18
    assert all(np.min(np.hypot(*(centres - place).T)) < 0.03 for place in wanted)


def test_contact_lines_cross_the_boundary_from_both_sides():
    packing = jamlab.Packing("sp", BOX, [[0.2, 1.0], [3.6, 1.0]], {"eps": 1.0}, diameters=[1.0, 1.0])
    ends = {tuple(np.round(line[:, 0], 9)) for line in lines(drawn(packing))}
    assert ends == {(-3.8, -4.4), (0.2, -0.4), (4.2, 3.6)}  # one contact in three columns of images


def test_droplets_are_filled_to_their_rim():
    polygon = regular_polygon(12, 1.0)
    params = {"gamma": 0.1, "ka": 50.0, "eps": 1.0, "delta": 0.2, "eta": 0.0, "contact": "outline", "a0": [1.0]}
    packing = jamlab.Packing("dp", BOX, polygon + 2.0, params, offsets=[0, 12])
    (fill,) = (path.vertices for path in fills(drawn(packing)) if path.contains_point((2.0, 2.0)))
    assert abs(np.hypot(*(fill - 2.0).T).max() - np.hypot(*polygon[0]) - 0.1) < 1e-3


@pytest.mark.parametrize("kind", ["pdf", "svg"])
def test_pictures_of_lines_are_the_same_every_time(tmp_path, kind):
    files = [tmp_path / f"{name}.{kind}" for name in ("a", "b")]
    for file in files:
        figure = Figure(figsize=(2, 2))
        figure.subplots().plot([1, 3, 2], clip_on=True)
        save_picture(figure, file)
    first, second = (file.read_bytes() for file in files)
    assert first == second and first.startswith({"pdf": b"%PDF", "svg": b"<?xml"}[kind])


def some_disks(positions, diameters, box):
    return Packing("sp", np.asarray(box), np.atleast_2d(positions), {"eps": 1.0}, diameters=diameters)


@pytest.mark.parametrize("state", ["sp", "dp"])
def test_void_paths_enclose_their_area(request, state):
    packing = some_disks([[0.3, 0.9], [0.81, 0.39]], [1.02, 0.35], np.eye(2))
    if state == "dp":
        packing = request.getfixturevalue("dp_dense")
    found = voids(packing)
    for path, area, centre in zip(void_paths(found), found.area, found.centroid, strict=True):
        signed = abs(sum(_signed(ring) for ring in path.to_polygons(closed_only=True)))  # islands run the other way
        np.testing.assert_allclose(signed, area, rtol=0.02)
        assert np.abs((path.vertices.mean(axis=0) - centre) @ np.linalg.inv(packing.box)).max() <= 0.5


@pytest.mark.parametrize("state", ["sp_jammed", "dp_dense"])
def test_points_of_void_paths_lie_on_particles(request, state):
    """Half a diameter from a centre, or half a rim from an outline, and nowhere within."""
    packing = request.getfixturevalue(state)
    points = np.concatenate([path.vertices for path in void_paths(voids(packing))])[::13]
    points -= np.floor(points @ np.linalg.inv(packing.box)) @ packing.box
    far = np.full(len(points), np.inf)
    for image in np.ndindex(5, 5):
        sites = packing.positions + (np.array(image) - 2) @ packing.box
        if packing.model == "sp":
            apart = np.hypot(*(points[:, None] - sites).T).T - packing.diameters / 2
        else:
            rings = [shapely.LinearRing(ring) for ring in np.split(sites, packing.offsets[1:-1])]
            apart = shapely.distance(shapely.points(points)[:, None], rings) - packing.params["delta"] / 2
        far = np.minimum(far, apart.min(axis=1))
    assert len(points) > 50 and np.abs(far).max() < 1e-10


def _signed(ring):
    (x, y), (u, v) = ring[:-1].T, ring[1:].T
    return 0.5 * float(np.sum(x * v - y * u))
