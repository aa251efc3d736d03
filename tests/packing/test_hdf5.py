"""HDF5 files: every bit comes back, MDAnalysis reads them, errors tell what to do."""

import os

import h5py
import MDAnalysis
import numpy as np
import pytest
from edited_files import edited

from jamlab.errors import InputError, StorageError
from jamlab.packing.hdf5 import read_all_hdf5, read_hdf5, read_observables
from jamlab.packing.lammps_files import write_dump
from jamlab.packing.packing import Packing
from jamlab.packing.write import write
from jamlab.storage.verified_file import SCHEMA_VERSION

BOX = np.array([[3.3, 0.0], [0.37, 2.9]])
LAW = {"gamma": 0.1, "ka": 50.0, "eps": 1 / 3, "delta": 0.25, "eta": 0.0, "contact": "outline"}


def disks(seed=0, box=BOX, **changes):
    rng = np.random.default_rng(seed)
    values = {"params": {"eps": 0.1}, "diameters": np.array([1, 1.4, 1, 1.4, 1]) / 1.2} | changes
    return Packing("sp", box, rng.uniform(-4, 4, (5, 2)), **values)


def polygons(seed=0, box=BOX, sides=(5, 7), **changes):
    rng = np.random.default_rng(seed)
    rings = []
    for centre, nv in zip(((0.1, 0.1), (3.2, 2.8)), sides, strict=True):  # both cross the edge of the box
        angle = 2 * np.pi * np.arange(nv) / nv
        rings.append(centre + 0.4 * np.column_stack([np.cos(angle), np.sin(angle)]) + rng.uniform(-0.05, 0.05, (nv, 2)))
    values = {"params": LAW | {"a0": np.array([0.5, 0.4]) / 3}, "offsets": np.cumsum([0, *sides])} | changes
    return Packing("dp", box, np.concatenate(rings), **values)


def sweep(make):
    """Three frames in boxes sheared one way, the other way, and by more than the box is wide."""
    return [make(k, box=np.array([[3.3 - k / 7, 0.0], [tilt, 2.9]])) for k, tilt in enumerate((0.37, -1.1, 5.3))]


def assert_same_bits(a, b):
    if isinstance(a, dict):
        assert isinstance(b, dict) and a.keys() == b.keys()
        for key in a:
            assert_same_bits(a[key], b[key])
    elif isinstance(a, np.ndarray):
        assert isinstance(b, np.ndarray)
        assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
    else:
        assert type(a) is type(b) and a == b


def test_provenance_survives_and_numpy_numbers_become_plain(tmp_path):
    plain = {"seed": 7, "none": None, "yes": True, "text": "µ", "tolerance": 1 / 3, "empty": {}}
    plain |= {"nested": {"list": [1, 2.5, None, {"deep": False}]}, "infinite": float("inf")}
    numpy = {"i": np.int64(3), "f": np.float64(0.1), "single": np.float32(0.5), "b": np.bool_(True)}
    numpy |= {"array": np.array([[1.5, 2.0]])}
    write(tmp_path / "run.h5", [disks(provenance=plain | numpy), disks(provenance={"frame": 1})])
    expected = plain | {"i": 3, "f": 0.1, "single": 0.5, "b": True, "array": [[1.5, 2.0]]}
    assert_same_bits(read_hdf5(tmp_path / "run.h5", frame=0).provenance, expected)
    assert_same_bits(read_hdf5(tmp_path / "run.h5", frame=1).provenance, {"frame": 1})


def test_entries_of_a_provenance_may_have_any_name(tmp_path):
    given = {"state": {"converged": True}, "ensemble": "mine", "rounding": 3, "\ud800": "a\0b"}
    write(tmp_path / "run.h5", [disks(provenance=given, rounding=1e-3, on_target=False)])
    back = read_hdf5(tmp_path / "run.h5")
    assert_same_bits(back.provenance, given)
    assert (back.rounding, back.on_target, back.converged, back.ensemble) == (1e-3, False, False, "fixed-box")


def test_numbers_that_others_shortened_make_a_rounded_packing(tmp_path):
    packing = disks(max_force=1e-15, converged=True, force_tolerance=1e-12, on_target=False)
    for part in ("particles/all/position/value", "particles/all/box/edges/value", "parameters/diameters"):
        write(tmp_path / "run.h5", [packing, packing])
        with edited(tmp_path / "run.h5") as file:
            values = file[part][()]
            del file[part]
            file[part] = values.astype("f4")
        for back in read_all_hdf5(tmp_path / "run.h5"):
            error = np.abs(values - values.astype("f4")).max()
            assert error < back.rounding < 1e-6
            assert (back.converged, back.max_force, back.force_tolerance, back.on_target) == (False, None, None, False)


def test_observables_scalar_and_vector(tmp_path):
    results = {"g": [0.1, np.nan, 0.3], "shape": np.arange(15.0).reshape(3, 5) / 7, "count": np.array([1, 2, 3])}
    write(tmp_path / "run.h5", sweep(disks), results)
    back = read_observables(tmp_path / "run.h5")
    assert_same_bits(back, {name: np.asarray(values, dtype=np.float64) for name, values in results.items()})
    write(tmp_path / "bare.h5", sweep(disks))
    assert read_observables(tmp_path / "bare.h5") == {}


def test_layout_is_h5md(tmp_path):
    write(tmp_path / "run.h5", sweep(polygons), {"g": [1, 2, 3]})
    with h5py.File(tmp_path / "run.h5") as file:
        assert (file.attrs["schema"], file.attrs["schema_version"]) == ("jamlab", 2)
        assert file["h5md"].attrs["version"].tolist() == [1, 1]
        assert file["h5md/author"].attrs["name"] and file["h5md/creator"].attrs["version"]
        box = file["particles/all/box"]
        assert (box.attrs["dimension"], box.attrs["boundary"].tolist()) == (3, ["periodic"] * 3)
        for name, shape in (("particles/all/position", (3, 12, 3)), ("particles/all/box/edges", (3, 3, 3))):
            assert (file[name]["value"].shape, file[name]["value"].dtype) == (shape, np.float64)
        for name in ("particles/all/position", "particles/all/box/edges", "observables/g"):
            assert file[name]["step"][:].tolist() == [0, 1, 2]
            assert file[name]["time"][:].tolist() == [0.0, 1.0, 2.0]
        assert not file["particles/all/position/value"][:, :, 2].any()


@pytest.mark.filterwarnings("ignore:Guessed all Masses to 1.0:UserWarning")
@pytest.mark.parametrize("make", [disks, polygons])
def test_mdanalysis_reads_box_positions_and_observables_of_each_frame(tmp_path, make):
    frames = sweep(make)
    write(tmp_path / "run.h5", frames, {"phi": [p.phi for p in frames]})
    write_dump(tmp_path / "run.dump", frames)
    dump, run = str(tmp_path / "run.dump"), str(tmp_path / "run.h5")
    universe = MDAnalysis.Universe(dump, run, topology_format="LAMMPSDUMP", format="H5MD", convert_units=False)
    assert (len(universe.trajectory), len(universe.atoms)) == (3, len(frames[0].positions))
    for packing, step in zip(frames, universe.trajectory, strict=True):
        np.testing.assert_allclose(step.positions[:, :2], packing.positions, atol=1e-6)
        np.testing.assert_allclose(step.triclinic_dimensions[:2, :2], packing.box, atol=1e-5)
        np.testing.assert_allclose(step.triclinic_dimensions[2], [0, 0, 1], atol=1e-6)
        assert step.data["phi"] == packing.phi
        assert step.time == step.frame


@pytest.mark.parametrize(
    ("first", "second", "name"),
    [
        (disks(), polygons(), "model"),
        (disks(), disks(diameters=np.ones(5)), "diameters"),
        (disks(), disks(params={"eps": 0.2}), "params['eps']"),
        (disks(), disks(params={"k": 0.1}, units="k"), "units"),
        (polygons(), polygons(sides=(6, 6)), "offsets"),
        (polygons(), polygons(params=LAW | {"a0": np.ones(2)}), "params['a0']"),
    ],
)
def test_packings_of_another_sweep_are_refused(tmp_path, first, second, name):
    with pytest.raises(InputError) as caught:
        write(tmp_path / "run.h5", [first, second])
    assert "frame 1" in str(caught.value) and name in str(caught.value)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("packings", "observables"),
    [
        ([], None),
        ([disks()], {"g": [1, 2]}),
        ([disks()], {"g": 1.0}),
        ([disks()], {"g": ["high"]}),
        ([disks()], {"a/b": [1.0]}),
        ([disks()], {"\ud800": [1.0]}),
        ([disks()], {"a\0b": [1.0]}),
        ([disks(provenance={"odd": {1, 2}})], None),
    ],
)
def test_values_that_no_file_can_hold_are_refused(tmp_path, packings, observables):
    with pytest.raises(InputError):
        write(tmp_path / "run.h5", packings, observables)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("call", [read_hdf5, read_all_hdf5, read_observables])
def test_files_that_are_not_whole_jamlab_files_are_refused(tmp_path, call):
    write(tmp_path / "run.h5", [disks()])
    whole = (tmp_path / "run.h5").read_bytes()
    (tmp_path / "text.h5").write_text("not HDF5")
    (tmp_path / "empty.h5").touch()
    (tmp_path / "cut.h5").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "short.h5").write_bytes(whole[:-1])
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["x"] = 1
    (tmp_path / "folder.h5").mkdir()
    for name in ("absent.h5", "folder.h5", "text.h5", "empty.h5", "cut.h5", "short.h5", "foreign.h5"):
        with pytest.raises(StorageError) as caught:
            call(tmp_path / name)
        assert str(tmp_path / name) in str(caught.value)


def test_a_newer_schema_names_the_jamlab_that_is_needed(tmp_path):
    write(tmp_path / "run.h5", [disks()])
    with edited(tmp_path / "run.h5") as file:
        file.attrs["schema_version"] = SCHEMA_VERSION + 1
        file["h5md/creator"].attrs["version"] = "7.8.9"
    with pytest.raises(StorageError, match=r"install jamlab 7\.8\.9"):
        read_hdf5(tmp_path / "run.h5")


def test_a_file_of_an_earlier_layout_is_refused(tmp_path):
    write(tmp_path / "run.h5", [disks()])
    with edited(tmp_path / "run.h5") as file:
        file.attrs["schema_version"] = SCHEMA_VERSION - 1
        file["parameters"].move("phi_J", "onset")
    with pytest.raises(StorageError, match=f"schema {SCHEMA_VERSION - 1} of an earlier jamlab"):
        read_hdf5(tmp_path / "run.h5")


@pytest.mark.parametrize("name", ["a.txt", "a.png"])
def test_packings_do_not_go_into_a_file_of_another_kind(tmp_path, name):
    for packings in (disks(), [disks()]):
        with pytest.raises(InputError):
            write(tmp_path / name, packings)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["\ud800", "a\0b", "a/b", "", "."])
def test_a_name_that_cannot_be_stored_is_refused_before_packings_are_made(tmp_path, name):
    """Lone surrogates are no UTF-8, HDF5 ends text at a null character, and a slash makes groups."""

    def made():
        raise AssertionError("a packing was made")
        yield

    with pytest.raises(InputError) as caught:
        write(tmp_path / "o.h5", made(), observables={name: [1.0]})
    assert repr(name) in str(caught.value) and not list(tmp_path.iterdir())
