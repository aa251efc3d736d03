"""Spectra of several packings: mean and band, what is written, and what is refused."""

import csv
import re
from dataclasses import replace

import h5py
import numpy as np
import pandas as pd
import pytest

import jamlab
from jamlab.cli.gstar import check_one_kind, check_output, save
from jamlab.rheology.mean_spectrum import Spectra, group_packings, mean_spectra

OMEGA = np.geomspace(1e-4, 10, 9)


@pytest.fixture(scope="module")
def three():
    packings = [jamlab.pack(32, 1e-2, seed, ensemble="shear-stabilized") for seed in (1, 2, 3)]
    return Spectra(tuple(jamlab.complex_modulus(p, OMEGA) for p in packings), "k", (True, False, True), (0.1, 0.2, 0.3))


def test_band_is_mean_and_standard_error(three):
    values = np.array([s.loss for s in three.members])
    mean, low, high = three.band("loss")
    assert mean == pytest.approx(values.sum(axis=0) / 3, rel=1e-14)
    error = np.sqrt(((values - mean) ** 2).sum(axis=0) / 2 / 3)
    assert high - mean == pytest.approx(error, rel=1e-12) and mean - low == pytest.approx(error, rel=1e-12)
    one = Spectra(three.members[:1], "k", (True,), (0.1,))
    mean, low, high = one.band("storage")
    assert np.array_equal(low, mean) and np.array_equal(high, mean)


def test_summary_and_rows_say_what_did_not_converge(three):
    summary = three.summary()
    assert summary["converged"] is False and "1 NOT CONVERGED" in three.description
    assert summary["g0"] == pytest.approx(np.mean([s["g0"] for s in summary["packings"]]), rel=1e-14)
    names, rows = three.rows()
    assert len(rows) == len(OMEGA) and all(len(row) == len(names) == 6 for row in rows)


def test_hdf5_holds_every_number(three, tmp_path):
    save([three], jamlab.ContactDamping(), tmp_path / "s.h5")
    with h5py.File(tmp_path / "s.h5") as file:
        assert np.array_equal(file["omega"], OMEGA)
        assert np.array_equal(file["storage"][1], three.members[1].storage)
        assert list(file["converged"]) == [True, False, True]
        assert file.attrs["damping"] == repr(jamlab.ContactDamping()) and file.attrs["units"] == "k"


def test_packings_that_differ_are_never_averaged():
    """Seeds alone may be averaged; pressure, size, ensemble, sizes and units each make a curve of their own."""
    same = [jamlab.pack(16, 1e-2, seed) for seed in (1, 2)]
    others = [
        jamlab.pack(16, 2e-2, 1),
        jamlab.pack(24, 1e-2, 1),
        jamlab.pack(16, 1e-2, 1, ensemble="shear-stabilized"),
        jamlab.pack(16, 1e-2, 1, ratio=1.2),
        jamlab.jam("sp", 16, 1, ensemble="shear-stabilized"),
    ]
    packings = [same[0], *others, same[1]]
    groups = group_packings(packings)
    assert [len(group) for group in groups] == [2, 1, 1, 1, 1, 1]
    curves = mean_spectra(packings[:3], OMEGA)
    assert len({c.label for c in curves}) == 3 and "n = 24" in curves[2].label and "p = 0.02 k" in curves[1].label
    first = curves[0]
    measured = jamlab.measure(same[0])
    assert first.g[0] == pytest.approx(measured["g"], rel=1e-12)
    assert first.members[0].g0 == pytest.approx(measured["g_x"], rel=1e-8)


@pytest.mark.parametrize(("ending", "separator"), [(".csv", ","), (".tsv", "\t")])
@pytest.mark.parametrize("points", [2, len(OMEGA)])
def test_table_opens_as_pyrheo_and_rheojax_read_it(three, tmp_path, points, ending, separator):
    """pyRheo: columns by name, separated by tabs. rheojax: the separator that Sniffer finds, columns by pattern."""
    path = tmp_path / f"s{ending}"
    names = ("omega", "storage", "loss", "error")
    cut = (replace(s, **{name: getattr(s, name)[:points] for name in names}) for s in three.members)
    few = replace(three, members=tuple(cut))
    save([few], jamlab.ContactDamping(), path)
    found = pd.read_csv(path, delimiter=separator)
    assert list(found.columns) == ["Angular Frequency", "Storage Modulus", "Loss Modulus"]
    assert np.array_equal(found["Angular Frequency"], few.omega)
    assert np.array_equal(found["Storage Modulus"], few.band("storage")[0])
    assert np.array_equal(found["Loss Modulus"], few.band("loss")[0])
    assert csv.Sniffer().sniff(path.read_text(), delimiters=[",", "\t", ";", "|", " "]).delimiter == separator
    patterns = ("angular frequency", r"storage\s+modulus", r"loss\s+modulus")
    assert [[bool(re.search(p, c.lower())) for c in found.columns] for p in patterns] == np.eye(3, dtype=bool).tolist()


def test_several_kinds_in_a_table_unknown_endings_and_places_are_refused(tmp_path):
    same, other = jamlab.pack(16, 1e-2, 1), jamlab.pack(16, 2e-2, 1)
    check_one_kind(tmp_path / "s.csv", [same, same])
    check_one_kind(tmp_path / "s.h5", [same, other])
    with pytest.raises(jamlab.InputError, match="packings of 2 kinds"):
        check_one_kind(tmp_path / "s.csv", [same, other])
    with pytest.raises(jamlab.InputError, match=r"s\.txt.*\.svg.*\.csv.*\.h5"):
        check_output(tmp_path / "s.txt")
    with pytest.raises(jamlab.StorageError, match="nowhere"):
        check_output(tmp_path / "nowhere" / "s.h5")
