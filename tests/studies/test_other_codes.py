"""Other codes on the same disks: agreement, absent peers, recipes."""

import pytest
from commands import call_studies

from studies.other_codes.compare import HERE, compare, compare_analysis, jolted_minimum
from studies.other_codes.peers import Analyst, Lammps, Peer


class Absent(Peer):
    name, package, method = "absent", "a-package-that-nobody-has", "none"

    def evaluate(self, packing):
        raise AssertionError("an absent peer was asked")

    descent = evaluate


class Wrong(Lammps):
    """A code whose springs are a millionth too stiff."""

    def evaluate(self, packing):
        return super().evaluate(packing.with_state(params={"eps": 1 + 1e-6}))


@pytest.fixture(scope="module")
def rows():
    return compare(32, 2, peers=[Lammps("cg"), Lammps("fire"), Wrong("cg"), Absent()])


def test_same_coordinates_give_the_same_forces(rows):
    """jamlab against all pairs in numpy; LAMMPS' expression style against jamlab: three ways to the same digits."""
    for row in rows[:3]:
        assert max(row["energy"], row["forces"], row["stress"], row["pressure"]) < 1e-12
    assert rows[3]["energy"] == pytest.approx(1e-6, rel=1e-3)


def test_same_basin_gives_the_same_minimum(rows):
    for row in rows[:3]:
        assert row["max_force"] < 2e-12 and row["minimum"] < 1e-12
        assert row["z"] == 0.0 and abs(row["g"]) < 1e-7
        assert 0 < row["warm"] and 0 < row["cold"] and row["warm_ratio"] == pytest.approx(row["warm"] / rows[0]["warm"])


def itself(packing):
    """jamlab's own numbers, the modulus a thousandth too high."""
    return {name: find(packing) * (1.001 if name == "shear modulus" else 1) for name, find in HERE.items()}


def test_libraries_of_analysis_see_the_backbone():
    _, minimum = jolted_minimum(16, 1, 0.9)
    *rows, absent = compare_analysis(
        minimum, analysts=[Analyst("itself", "jamlab", itself), Analyst("absent", Absent.package, itself)]
    )
    found = {row["quantity"]: row["difference"] for row in rows}
    assert set(found) == set(HERE)
    assert found.pop("shear modulus") == pytest.approx(1e-3) and not any(found.values())
    assert (absent["version"], absent["note"]) == (None, "not installed: pip install 'jamlab[peers]'")


def test_a_packing_that_is_not_jammed_is_refused(tmp_path):
    done = call_studies(tmp_path, "compare", "--phi", "0.2", "--n", "8", "--json")
    assert done.exit_code == 1 and not done.stdout and "phi" in done.stderr
