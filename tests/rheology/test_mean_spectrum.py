"""Spectra of several packings: mean and band, what is written, and what is refused."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import jamlab
from jamlab.cli.gstar import _summary, check_output, print_spectra, save
from jamlab.mechanics.like_packings import group_by_kind
from jamlab.rheology.mean_spectrum import MeanSpectra

OMEGA = np.geomspace(1e-4, 10, 9)


@pytest.fixture(scope="module")
def three():
    packings = [jamlab.pack(32, 1e-2, seed, ensemble="shear-stabilized") for seed in (1, 2, 3)]
    packings[1] = packings[1].with_state(converged=False)
    (found,) = jamlab.mean_spectra(packings, OMEGA)
    return found


def test_band_is_mean_and_standard_error(three):
    values = np.array([each.loss for each in three.spectra])
    mean, low, high = three.band("loss")
    assert mean == pytest.approx(values.sum(axis=0) / 3, rel=1e-14)
    error = np.sqrt(((values - mean) ** 2).sum(axis=0) / 2 / 3)
    assert high - mean == pytest.approx(error, rel=1e-12) and mean - low == pytest.approx(error, rel=1e-12)
    assert three.to_dataframe()["loss_stderr"].to_numpy() == pytest.approx(error, rel=1e-12)
    one = replace(three, storage_stderr=np.full(len(OMEGA), np.nan))
    mean, low, high = one.band("storage")
    assert np.array_equal(low, mean) and np.array_equal(high, mean)


def test_numbers_and_words_say_what_did_not_converge(three, capsys):
    content = _summary(three)
    assert content["converged"] is False and len(content["packings"]) == 3
    assert content["g0"] == pytest.approx(np.mean([each["g0"] for each in content["packings"]]), rel=1e-14)
    print_spectra(MeanSpectra((three,), jamlab.ContactDamping()))
    assert "1 NOT CONVERGED" in capsys.readouterr().out


def test_packings_that_differ_are_never_averaged(tmp_path):
    """Seeds alone may be averaged; pressure, size, ensemble, sizes, law, walls and units each make a kind of its own,
    with the numbers that it has alone, in the table, in files and under a name of its own."""
    first = jamlab.pack(16, 1e-2, 1)
    packings = [
        first,
        jamlab.pack(16, 2e-2, 1),
        jamlab.pack(24, 1e-2, 1),
        first.with_state(ensemble="shear-stabilized", converged=True),
        jamlab.pack(16, 1e-2, 1, size_ratio=1.2),
        first.with_state(params={"k": 2.0}, converged=True),
        first.with_state(fixed=np.arange(16) == 3, converged=True),
        jamlab.pack(16, 1e-2, 2),
    ]
    omega = [1e-3, 1.0]
    found = jamlab.mean_spectra(packings, omega, prestress=False)
    assert [s.packings["packing"].tolist() for s in found] == [[0, 7], *([k] for k in range(1, 7))]
    assert len({s.kind for s in found}) == 7
    assert len(group_by_kind([first, first.with_state(units="eps", params={"eps": 1.0})])) == 2
    table = found.to_dataframe()
    for s in (found[0], found[3]):
        rows = table[table["kind"] == s.kind]
        alone = [jamlab.complex_modulus(packings[k], omega, prestress=False) for k in s.packings["packing"]]
        mean = np.mean([each.storage for each in alone], axis=0)
        assert rows["storage"].to_numpy() == pytest.approx(mean, rel=1e-14)
    assert table["storage_stderr"].notna().sum() == 2 and set(table["packings"]) == {1, 2}
    save(found, tmp_path / "g.csv")
    written = pd.read_csv(tmp_path / "g.csv")
    assert list(written)[:2] == ["Kind", "Angular Frequency"] and set(written["Kind"]) == set(table["kind"])
    assert len(found.plot(Figure().subplots()).lines) == 14


def test_kinds_whose_sizes_no_label_tells_apart_are_numbered():
    sizes = 1 + 0.01 * np.arange(16)
    packings = [jamlab.pack(16, 1e-2, 1, sizes=each / each.mean()) for each in (sizes, sizes + 0.3 * (sizes > 1.14))]
    found = jamlab.mean_spectra(packings, [1.0], prestress=False)
    assert len(found) == 2 == len({s.kind for s in found})


def test_the_static_moduli_are_those_of_measure():
    packing = jamlab.pack(16, 1e-2, 1)
    (found,) = jamlab.mean_spectra(packing, OMEGA)
    measured = jamlab.measure(packing)
    assert found.packings["g"][0] == pytest.approx(measured["g"], rel=1e-12)
    assert found.packings["g0"][0] == pytest.approx(measured["g_x"], rel=1e-8)
    with pytest.raises(jamlab.InputError, match="packings"):
        jamlab.mean_spectra([], OMEGA)
    loose = packing.with_state(box=2 * packing.box)
    with pytest.raises(jamlab.ConvergenceError, match="packing 1: "):
        jamlab.mean_spectra([packing, loose], OMEGA)


def test_unknown_endings_and_places_are_refused(tmp_path):
    with pytest.raises(jamlab.InputError, match="end its name in"):
        check_output(tmp_path / "s")
    with pytest.raises(jamlab.StorageError, match="nowhere"):
        check_output(tmp_path / "nowhere" / "s.png")


def test_a_packing_counts_once_in_a_mean():
    first, other = (jamlab.pack(16, 1e-2, seed=seed) for seed in (1, 2))
    twice = [first, other, first.with_state(provenance={"note": 1})]
    for mean in (jamlab.density_of_states, lambda packings: jamlab.mean_spectra(packings, [1.0], prestress=False)):
        with pytest.raises(jamlab.InputError, match=r"packings\[0\] and packings\[2\] are of the same packing"):
            mean(twice)
