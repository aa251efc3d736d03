"""HDF5 files that are damaged, or made to harm: noticed and named, never a traceback and never a wrong packing."""

import h5py
import numpy as np
import pytest
from commands import call
from edited_files import edited
from wandering_packings import disks, polygons

from jamlab.errors import InputError, JamlabError, StorageError
from jamlab.packing.hdf5 import read_all_hdf5, read_hdf5
from jamlab.packing.write import write
from jamlab.storage.verified_file import USER_BLOCK, checksum, dataset

POSITIONS = "particles/all/position/value"
BOX = "particles/all/box/edges/value"
HISTORY = "parameters/provenance"
STATE = "parameters/state"


@pytest.fixture(params=[disks, polygons], ids=["disks", "droplets"])
def path(request, tmp_path):
    write(tmp_path / "run.h5", [request.param(1, 0.3)], {"g": [1.0]})
    return tmp_path / "run.h5"


def replace(name, value, **how):
    def edit(file):
        del file[name]
        file.create_dataset(name, data=value, **how)

    return edit


def declare(name, *shape, kind="f8"):
    """A dataset without content: HDF5 hands out zeros for what is not stored."""

    def edit(file):
        del file[name]
        file.create_dataset(name, shape=shape, dtype=kind, chunks=tuple(min(length, 1000) for length in shape))

    return edit


def link(name, target):
    def edit(file):
        del file[name]
        file[name] = target

    return edit


def attribute(place, name, value):
    return lambda file: file[place].attrs.__setitem__(name, value)


def box(width, tilt, height):
    return replace(BOX, np.array([[[width, 0, 0], [tilt, height, 0], [0, 0, 1]]], dtype=float))


def as_type(name, kind):
    return lambda file: replace(name, file[name][()].astype(kind))(file)


def no_frames(file):
    for name in (POSITIONS, BOX, "parameters/phi_J"):
        replace(name, file[name][()][:0])(file)
    for name in (HISTORY, STATE):
        replace(name, np.array([], dtype=object), dtype=h5py.string_dtype())(file)


HOSTILE = {
    **{f"provenance {text[:20]}": replace(HISTORY, [text]) for text in (
        "null", "3", "[]", "NaN", '"a"', "{", "[" * 100_000, "9" * 5000)},
    "provenance of numbers": replace(HISTORY, [3]),
    "no record of the state": lambda file: file.pop(STATE),
    "ensemble 3": replace(STATE, ['{"ensemble": 3}']),
    "max_force text": replace(STATE, ['{"max_force": "a"}']),
    "a state of no packing": replace(STATE, ['{"temperature": 1}']),
    "a state that is a list": replace(STATE, ["[1]"]),
    "no frames": no_frames,
    **{f"version {value}": attribute("/", "schema_version", value) for value in (
        np.inf, np.nan, "a", [1, 2], -1, 0, 1.5, True, 10**18)},
    "schema of numbers": attribute("/", "schema", [1, 2]),
    "model of numbers": attribute("parameters", "model", [1, 2]),
    "1e12 positions": declare(POSITIONS, 1, 10**12, 3),
    "1e12 frames": declare(POSITIONS, 10**12, 5, 3),
    "1e12 onsets": declare("parameters/phi_J", 10**12),
    "1e12 parameters": declare("parameters/force_law/eps", 10**12),
    "bool positions": as_type(POSITIONS, bool),
    "complex positions": as_type(POSITIONS, complex),
    "flat positions": replace(POSITIONS, np.zeros(6)),
    "far positions": lambda file: replace(POSITIONS, 1e300 * file[POSITIONS][()])(file),
    "wide box": box(1e300, 0, 1e300),
    "tiny box": box(1e-300, 0, 1e-300),
    "tilted box": box(3, 1e300, 3),
    "hanging tilt": box(3, 1e17, 3),
    "flat box": box(1e9, 0, 1),
    "crowded box": box(1e-3, 0, 1e-3),
    "group for dataset": link(POSITIONS, h5py.SoftLink("/parameters")),
    "dataset for group": replace("parameters/force_law", 3),
    "group among parameters": lambda file: file.create_group("parameters/force_law/x"),
    "link to nowhere": link(POSITIONS, h5py.SoftLink("/nowhere")),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_what_no_packing_can_be_is_named_with_file_and_thing(path, name):
    with edited(path) as file:
        HOSTILE[name](file)
    for act in (read_hdf5, read_all_hdf5):
        with pytest.raises((StorageError, InputError)) as caught:
            act(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    done = call(path.parent, "analyze", path.name)
    assert done.exit_code == 1 and done.stderr.count("\n") == 1


def test_a_dataset_that_stores_a_little_of_what_it_declares_is_not_read(path):
    with edited(path) as file:
        del file["parameters/phi_J"]
        made = file.create_dataset("parameters/phi_J", shape=(200_000,), dtype="f8", chunks=(100,))
        made[:100] = 1.0  # the others are zeros that HDF5 makes up
    with pytest.raises(StorageError, match="shape"):
        read_hdf5(path)
    with h5py.File(path) as file, pytest.raises(StorageError, match="declared"):
        dataset(file, "parameters/phi_J", "f")


@pytest.mark.parametrize(
    "offsets", [[0, 2**62, 12], [0, -5, 12], [0, 5, 2**63 - 1], np.array([0, 5, 2**64 - 1], "u8"), [0.0, 5.0, 12.0]]
)
def test_offsets_that_lead_nowhere(tmp_path, offsets):
    write(tmp_path / "run.h5", [polygons(1, 0.3)])
    with edited(tmp_path / "run.h5") as file:
        replace("parameters/offsets", offsets)(file)
    with pytest.raises((StorageError, InputError)):
        read_hdf5(tmp_path / "run.h5")


def test_a_file_without_checksum_is_read_and_analyze_says_so(path):
    packing = read_hdf5(path)
    assert checksum(path) == ("packings", True)
    assert "checksum" not in call(path.parent, "analyze", path.name).stderr
    path.write_bytes(path.read_bytes()[USER_BLOCK:])
    assert checksum(path) is None
    assert read_hdf5(path).positions.tobytes() == packing.positions.tobytes()
    assert "run.h5 has no checksum" in call(path.parent, "analyze", path.name).stderr


@pytest.mark.parametrize("flips", [30, pytest.param(200, marks=pytest.mark.slow)])
def test_single_bit_flips_are_noticed(path, flips):
    """Of 400 flips, 21 changed the content silently before there was a checksum."""
    whole = path.read_bytes()
    rng = np.random.default_rng(flips)
    for place, bit in zip(rng.integers(len(whole), size=flips), rng.integers(8, size=flips), strict=True):
        content = bytearray(whole)
        content[place] ^= 1 << bit
        path.write_bytes(content)
        with pytest.raises(JamlabError):
            read_hdf5(path)
    path.write_bytes(whole)
    read_hdf5(path)
