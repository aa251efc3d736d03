"""The reference packings: what ships is what its manifest and its card say, and can be made again."""

import json
import re

import h5py
import numpy as np
import pytest

import jamlab
from studies.commands import packings
from studies.reference_packings import (
    BY_NAME,
    CARD,
    FOLDER,
    MEASURED,
    METADATA,
    SETS,
    check_sets,
    make_sets,
    write_card,
)
from studies.tables import read_manifest, write_manifest

SMALL = ("disks-64-pressure-1e-2", "droplets-32-onset")


def test_all_sets_ship():
    assert sorted(read_manifest(FOLDER)) == sorted(f"{each.name}.h5" for each in SETS)


@pytest.mark.parametrize("name", SMALL)
def test_a_packing_is_a_minimum_with_the_numbers_of_the_file(name):
    with h5py.File(FOLDER / f"{name}.h5") as file:
        kept = {each: file[f"observables/{each}/value"][:] for each in MEASURED}
        assert np.array_equal(file["observables/seed/value"][:], np.arange(1, BY_NAME[name].seeds + 1))
    frames = jamlab.read_all(FOLDER / f"{name}.h5")
    assert all(each.converged for each in frames)
    measured = jamlab.measure(frames[1], MEASURED)
    for each in MEASURED:
        np.testing.assert_allclose(measured[each], kept[each][1], rtol=1e-6, atol=1e-11, err_msg=each)


def test_a_packing_is_made_again():
    again = BY_NAME[SMALL[0]].make(3)
    kept = jamlab.read_all(FOLDER / f"{SMALL[0]}.h5")[2]
    np.testing.assert_allclose(again.positions, kept.positions, atol=1e-6)


def test_the_card_is_written_from_the_files(tmp_path):
    for path in FOLDER.iterdir():
        (tmp_path / path.name).symlink_to(path)
    for name in (CARD, METADATA):
        (tmp_path / name).unlink()
    write_card(tmp_path)
    for name in (CARD, METADATA):
        assert (tmp_path / name).read_text(encoding="utf-8") == (FOLDER / name).read_text(encoding="utf-8")
    assert json.loads((FOLDER / METADATA).read_text())["rightsList"][0]["rightsIdentifier"] == "CC-BY-4.0"


def test_a_damaged_or_absent_file_is_named(tmp_path):
    for name in SMALL:
        (tmp_path / f"{name}.h5").write_bytes((FOLDER / f"{name}.h5").read_bytes()[: -1 if name == SMALL[0] else None])
    known = read_manifest(FOLDER)
    write_manifest(tmp_path, {f"{name}.h5": known[f"{name}.h5"] for name in (*SMALL, "disks-64-onset")})
    wrong = check_sets(tmp_path, again=0)
    assert [line.partition(":")[0] for line in wrong] == ["disks-64-onset.h5", f"{SMALL[0]}.h5"]


def test_an_unknown_set_is_refused(tmp_path):
    with pytest.raises(jamlab.InputError, match=r"unknown set 'disks-65-onset'.*disks-64-onset"):
        make_sets(tmp_path, ["disks-65-onset"])


def test_names_do_not_go_with_a_check():
    with pytest.raises(jamlab.InputError, match="--check"):
        packings(["disks-64-onset"], check=True)


def test_the_example_of_the_card_runs(monkeypatch):
    monkeypatch.chdir(FOLDER)
    found = {}
    exec(re.search(r"```python\n(.*?)```", (FOLDER / CARD).read_text(encoding="utf-8"), re.S)[1], found)
    assert found["x"].shape[1:] == (64, 2)
    assert found["box"].shape[1:] == (2, 2)
