"""A host whose locale has a decimal comma, as Qt, GTK and R set it, gets the same packings to the last bit."""

import locale
import shutil
import subprocess
import threading

import pytest

import jamlab
from jamlab.engine.decimal_point import DecimalPoint


@pytest.fixture
def comma(tmp_path, monkeypatch):
    """Function that sets the German locale, which is made for the test."""
    if (program := shutil.which("localedef")) is None:
        pytest.skip("no localedef, which makes locales")
    made = subprocess.run(
        [program, "-i", "de_DE", "-f", "UTF-8", tmp_path / "de_DE.UTF-8"], capture_output=True, check=False
    )
    if not (tmp_path / "de_DE.UTF-8").exists():
        pytest.skip(f"no German locale: {made.stderr.decode()}")
    monkeypatch.setenv("LOCPATH", str(tmp_path))
    before = locale.setlocale(locale.LC_NUMERIC)
    yield lambda: locale.setlocale(locale.LC_NUMERIC, "de_DE.UTF-8")
    locale.setlocale(locale.LC_NUMERIC, before)


def all_kinds():
    disks, droplets = jamlab.pack(n=8, pressure=2e-2, seed=1), jamlab.jam(6, "dp", 1)
    run = jamlab.shear(disks, 0.1, strain=0.01, rows=3)
    with jamlab.Session(disks) as session:
        session.command("variable x index 1.5")
        pressure = session.evaluate().pressure
    return disks, droplets, run.stress.tolist(), pressure, jamlab.evaluate(droplets).energy


@pytest.mark.slow
def test_a_decimal_comma_of_the_host_changes_nothing(comma):
    plain = all_kinds()
    comma()
    assert all_kinds() == plain
    assert locale.str(1.5) == "1,5"


@pytest.mark.slow
def test_other_threads_and_what_follows_keep_the_comma(comma):
    comma()
    said = []
    with DecimalPoint():
        said.append(locale.localeconv()["decimal_point"])
        other = threading.Thread(target=lambda: said.append(locale.localeconv()["decimal_point"]))
        other.start()
        other.join()
    said.append(locale.localeconv()["decimal_point"])
    assert said == [".", ",", ","]
    with pytest.raises(KeyError), DecimalPoint():
        raise KeyError
    assert locale.localeconv()["decimal_point"] == ","
