"""Spectra of several packings: mean and band, what is written, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import jamlab
from jamlab.cli.gstar import _summary, check_output, print_spectra
from jamlab.rheology.mean_spectrum import check_one_kind, mean_spectra

OMEGA = np.geomspace(1e-4, 10, 9)


@pytest.fixture(scope="module")
def three():
    packings = [jamlab.pack(32, 1e-2, seed, ensemble="shear-stabilized") for seed in (1, 2, 3)]
    packings[1] = packings[1].with_state(converged=False)
    return mean_spectra(packings, OMEGA)


def test_band_is_mean_and_standard_error(three):
    values = three.all_of("loss")
    mean, low, high = three.band("loss")
    assert mean == pytest.approx(values.sum(axis=0) / 3, rel=1e-14)
    error = np.sqrt(((values - mean) ** 2).sum(axis=0) / 2 / 3)
    assert high - mean == pytest.approx(error, rel=1e-12) and mean - low == pytest.approx(error, rel=1e-12)
    assert three.means()["loss_stderr"].to_numpy() == pytest.approx(error, rel=1e-12)
    one = replace(three, curves=three.curves.query("packing == 0"), packings=three.packings[:1])
    mean, low, high = one.band("storage")
    assert np.array_equal(low, mean) and np.array_equal(high, mean) and "loss_stderr" not in one.means()


def test_numbers_and_words_say_what_did_not_converge(three, capsys):
    content = _summary(three)
    assert content["converged"] is False and len(content["packings"]) == 3
    assert content["g0"] == pytest.approx(np.mean([each["g0"] for each in content["packings"]]), rel=1e-14)
    print_spectra(jamlab.ContactDamping(), three)
    assert "1 NOT CONVERGED" in capsys.readouterr().out


def test_packings_that_differ_are_never_averaged():
    """Seeds alone may be averaged; pressure, size, ensemble, sizes and units each are refused."""
    same = [jamlab.pack(16, 1e-2, seed) for seed in (1, 2)]
    others = [
        jamlab.pack(16, 2e-2, 1),
        jamlab.pack(24, 1e-2, 1),
        jamlab.pack(16, 1e-2, 1, ensemble="shear-stabilized"),
        jamlab.pack(16, 1e-2, 1, size_ratio=1.2),
        jamlab.jam(16, "sp", 1, ensemble="shear-stabilized"),
    ]
    for other in others:
        with pytest.raises(jamlab.InputError):
            check_one_kind([same[0], other])
    first = mean_spectra(same, OMEGA)
    measured = jamlab.measure(same[0])
    assert first.packings["g"][0] == pytest.approx(measured["g"], rel=1e-12)
    assert first.packings["g0"][0] == pytest.approx(measured["g_x"], rel=1e-8)


def test_unknown_endings_and_places_are_refused(tmp_path):
    with pytest.raises(jamlab.InputError, match=r"s\.txt"):
        check_output(tmp_path / "s.txt")
    with pytest.raises(jamlab.StorageError, match="nowhere"):
        check_output(tmp_path / "nowhere" / "s.png")
