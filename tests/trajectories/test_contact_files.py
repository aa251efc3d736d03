"""Contact networks and films: read back by hand, by OVITO and by VTK where they are installed."""

from functools import cache
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
from PIL import Image

import jamlab


@cache
def state(model):
    if model == "dp":
        return jamlab.jam(6, "dp", 1)
    return jamlab.pack(24, 5e-3, 2, law={"stickiness": 0.05}, ensemble="shear-stabilized")


@pytest.fixture(scope="module", params=["sp", "dp"])
def written(request, tmp_path_factory):
    packing, folder = state(request.param), tmp_path_factory.mktemp("contacts")
    for name in ("net.dump", "net.vtp"):
        jamlab.write_contacts(folder / name, packing)
    return packing, jamlab.contacts(packing), folder


def test_bonds_are_the_contacts(written):
    packing, network, folder = written
    bonds, points = (np.loadtxt(folder / name, skiprows=9) for name in ("net.bonds.dump", "net.dump"))
    np.testing.assert_array_equal(bonds[:, :2] - 1, network.pairs)
    np.testing.assert_allclose(np.abs(bonds[:, 2]), network.forces.size, rtol=1e-15)
    np.testing.assert_array_equal(bonds[:, 2] < 0, network.forces.gap > 0)
    np.testing.assert_allclose(bonds[:, 3], network.forces.gap, rtol=1e-15)
    moved = (points[:, 2:4] - packing.centroids) @ np.linalg.inv(packing.box)
    np.testing.assert_allclose(moved, np.rint(moved), atol=1e-12)
    np.testing.assert_array_equal(points[:, 7], network.rattlers)
    np.testing.assert_allclose((np.pi * points[:, 6] ** 2).sum(), jamlab.particle_areas(packing).sum(), rtol=0.2)


def test_lines_of_vtk_are_the_contacts(written):
    _, network, folder = written
    arrays = {}
    for each in ElementTree.parse(folder / "net.vtp").iter("DataArray"):
        values = np.array((each.text or "").split(), dtype=float)
        arrays[each.get("Name")] = values.reshape(-1, int(each.get("NumberOfComponents")))
    ends = arrays["Points"][arrays["connectivity"].astype(int).reshape(-1, 2), :2]
    np.testing.assert_allclose(ends[:, 1] - ends[:, 0], network.r, atol=1e-12)
    particle = arrays["particle"][arrays["connectivity"].astype(int).reshape(-1, 2), 0]
    np.testing.assert_array_equal(particle, network.pairs)
    assert arrays["offsets"][-1] == 2 * len(network.pairs)


def test_ovito_reads_particles_and_bonds(written):
    pytest.importorskip("ovito", reason="OVITO is not installed")
    from ovito.io import import_file
    from ovito.modifiers import LoadTrajectoryModifier

    _, network, folder = written
    pipeline, bonds = import_file(str(folder / "net.dump")), LoadTrajectoryModifier()
    columns = ["Particle Identifiers.1", "Particle Identifiers.2", "Force", "Gap", "Bearing"]
    bonds.source.load(str(folder / "net.bonds.dump"), columns=columns)
    pipeline.modifiers.append(bonds)
    found = pipeline.compute().particles
    np.testing.assert_array_equal(np.sort(found.bonds.topology[...], axis=1), np.sort(network.pairs, axis=1))
    np.testing.assert_allclose(np.abs(found.bonds["Force"]), network.forces.size, rtol=1e-6)
    assert found.count == network.packing.n


def test_vtk_reads_lines(written):
    vtk = pytest.importorskip("vtk", reason="VTK is not installed")
    _, network, folder = written
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(folder / "net.vtp"))
    reader.Update()
    found = reader.GetOutput()
    force = found.GetCellData().GetArray("force")
    assert found.GetNumberOfLines() == force.GetNumberOfTuples() == len(network.pairs)
    np.testing.assert_allclose([abs(force.GetValue(k)) for k in range(5)], network.forces.size[:5], rtol=1e-12)


def test_films_have_a_frame_for_each_packing(tmp_path):
    start = jamlab.pack(16, 1e-2, 1, law={"stickiness": 0.05})
    run = jamlab.quasistatic_shear(start, strain=0.01, strain_step=0.01)
    sweep = list(jamlab.compress(start, start.phi - 0.02, 0.01, by="phi"))
    for k, film in enumerate((run, sweep)):
        count = jamlab.write_movie(tmp_path / f"{k}.gif", film, fps=5)
        with Image.open(tmp_path / f"{k}.gif") as picture:
            assert picture.n_frames == count == len(run.frames if k == 0 else sweep) and picture.size == (1000, 500)
    assert not list(tmp_path.glob(".jamlab*"))


BAD = {
    "ending of a network": lambda f: f("net.png"),
    "no ending of bonds": lambda f: f("net.h5"),
    "a film of one": lambda f: jamlab.write_movie("a.gif", [state("sp")]),
    "no packings": lambda f: jamlab.write_movie("a.gif", []),
    "words": lambda f: jamlab.write_movie("a.gif", ["frame"] * 2),
    "ending of a film": lambda f: jamlab.write_movie("a.avi", [state("sp")] * 2),
    "no frames per second": lambda f: jamlab.write_movie("a.gif", [state("sp")] * 2, fps=0),
    "too many": lambda f: jamlab.write_movie("a.gif", [state("sp")] * 2, fps=500),
    "half a frame": lambda f: jamlab.write_movie("a.gif", [state("sp")] * 2, fps=2.5),
    "a packing alone": lambda f: jamlab.write_movie("a.gif", state("sp")),
}
NAMED = {"ending of a network": "net.png", "no ending of bonds": "net.h5", "ending of a film": "a.avi"}
NAMED |= {"too many": "500", "words": "frame", "half a frame": "2.5", "a film of one": "1"}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_before_a_file_is_written(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(jamlab.InputError) as caught:
        BAD[name](lambda file: jamlab.write_contacts(file, state("sp")))
    assert NAMED.get(name, "") in str(caught.value) and not list(tmp_path.iterdir())


@pytest.mark.parametrize("taken", ["", "cat > /dev/null\n"])
def test_ffmpeg_without_the_codec_is_named_and_leaves_no_file(taken, tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text(f"#!/bin/sh\n{taken}echo \"Unknown encoder 'h264'\" >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setitem(matplotlib.rcParams, "animation.ffmpeg_path", str(program))
    with pytest.raises(jamlab.JamlabError) as caught:
        jamlab.write_movie(tmp_path / "film.mp4", [jamlab.pack(8, 1e-2, seed) for seed in (1, 2)])
    assert "film.mp4" in str(caught.value) and [file.name for file in tmp_path.iterdir()] == ["ffmpeg"]
