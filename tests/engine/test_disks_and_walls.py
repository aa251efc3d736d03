"""Droplets, disks and walls in one box: energy, forces, virial and contacts against plain loops over the law.

E = (eps/2) (1 - d/delta_ij)^2 of the distance d between a point and a segment. Random configurations without symmetry,
atom IDs shuffled, half of the rings clockwise; on 1, 2 and 4 ranks, newton on and off.
"""

import numpy as np
import pytest
from deck_runs import OUTPUT as OF_DECKS
from deck_runs import SETTINGS
from outlines import DISKS, FORMS, WALLS, coefficients, evaluate, mixture, seam, write

from .test_plugin_on_ranks import columns, run

DECK = """
clear
newton {newton}
{settings}
atom_style molecular
bond_style zero nocoeff
special_bonds lj/coul 1.0 1.0 1.0
read_data {data}
bond_coeff *
mass * 1.0
pair_style circuloline 0.25 0.9 contact {form} walls 3*4 disks 5,6
{coefficients}
neighbor 0.1 bin
{output}
group walls type 3 4
group droplets type 1 2
compute on_walls walls polygon/group/group droplets
compute on_droplets droplets polygon/group/group walls
{more}
run 0
print "state-{name} {printed}"
"""
OUTPUT = """
thermo_style custom step pe press pxx pyy pxy fmax c_on_walls c_on_droplets c_on_walls[*] c_on_droplets[*]
thermo_modify norm no press virial
compute contacts all polygon/contact
dump contacts all local 1 {name}.contacts c_contacts[*]
dump_modify contacts format float %.17g
dump forces all custom 1 {name}.dump id fx fy
dump_modify forces sort id format float %.17g
"""
VALUES = ["pe", "pxx", "pyy", "pxy", *(f"c_on_{g}{k}" for g in ("walls", "droplets") for k in ("", "[1]", "[2]"))]


def deck_for(folder, name, outlines, box, form, *, newton="on", more=OUTPUT, values=VALUES):
    write(folder / f"{name}.data", outlines, box)
    fields = {"settings": SETTINGS, "output": OF_DECKS, "newton": newton, "name": name, "data": f"{name}.data"}
    fields |= {"form": "outline" if form == "mixed" else form, "coefficients": coefficients(form)}
    printed = " ".join(f"$({value}:%.17g)" for value in values)
    return DECK.format(more=more.format(name=name), printed=printed, **fields)


def told(contacts, outlines, box):
    """Vertex, edge tail and head, force, separation of each contact, in order of the tags.

    Where the closest point is an end of the edge, both edges there, and in form segment both vertices, say the same:
    such a contact is the two points, the lower tag first, and no edge. Walls have no direction.
    """
    place = np.vstack([o.points for o in outlines])[np.argsort(np.concatenate([o.tags for o in outlines]))]
    contacts = contacts.copy()
    for row in contacts:
        row[1:3] = np.sort(row[1:3])
        v, ends, r = int(row[0]), row[1:3].astype(int), row[5:].copy()
        off = (place[v - 1] - r - place[ends - 1]) @ np.linalg.inv(box)
        at = np.abs(off - np.rint(off)).max(axis=1) < 1e-9
        if at.any():
            end = ends[np.argmax(at)]
            row[:] = min(v, end), max(v, end), 0, *(row[3:] if v < end else -row[3:])
    return contacts[np.lexsort(np.rint(1e6 * contacts[:, ::-1]).T)]


@pytest.fixture(scope="module")
def mixtures():
    """Square, sheared, with a wall as long as the box, and so narrow that droplets and walls meet their own images."""
    narrow = mixture(4, 0.2, (1, 3, 2, 6, 5, 1), width=1.15, height=4.0)
    return {
        "square": mixture(1, 0.0),
        "sheared": mixture(2, 0.37),
        "back": mixture(3, -0.4),
        "seam": seam(),
        "narrow": narrow,
    }


def test_configurations_hold_every_kind_of_contact(mixtures):
    """What the tests below compare: each pair of roles meets, chains at their ends too, and own images."""
    found = [evaluate(outlines, box, "outline")[3] for outlines, box in mixtures.values()]
    roles = {kind: role for role, kinds in enumerate([(1, 2), WALLS, DISKS]) for kind in kinds}
    met = {tuple(sorted((roles[row[3]], roles[row[4]]))) for rows in found for row in rows}
    assert met == {(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)}
    assert {row[3] for rows in found for row in rows} == {1, 2, 3, 4, 5, 6}
    one = {tag: m for m, o in enumerate(mixtures["narrow"][0]) for tag in o.tags}
    assert any(one[row[0]] == one[row[1]] for row in found[-1])


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow), pytest.param(4, marks=pytest.mark.slow)])
def test_energy_forces_and_contacts_are_those_of_the_law(mixtures, tmp_path, ranks):
    wanted, deck = {}, ""
    some = (
        mixtures if ranks < 4 else {kind: mixtures[kind] for kind in ("sheared",)}
    )  # slow where there are fewer cores
    for kind, (outlines, box) in some.items():
        for k, form in enumerate((*FORMS, "mixed")):
            law = evaluate(outlines, box, form)
            for newton in ("on", "off"):
                name = f"{kind}-{k}-{newton}"
                deck += deck_for(tmp_path, name, outlines, box, form, newton=newton)
                wanted[name] = law
    printed = run(tmp_path, deck, ranks)
    assert len(printed) == len(wanted)
    for name, (energy, forces, stress, contacts) in wanted.items():
        pe, *pressure, e_walls, wx, wy, e_droplets, dx, dy = printed[f"state-{name}"]
        assert pe == pytest.approx(energy, rel=1e-12), name
        assert np.abs(pressure - stress[[0, 1, 0], [0, 1, 1]]).max() < 1e-12 * np.abs(stress).max(), name
        found, scale = columns(tmp_path / f"{name}.dump", 9), np.abs(forces).max()
        assert np.abs(found - forces).max() < 1e-12 * scale, name
        assert np.abs(found.sum(axis=0)).max() < 1e-12 * scale, name

        rows = np.loadtxt(tmp_path / f"{name}.contacts", skiprows=9)[:, [2, 3, 10, 6, 7, 8, 9]]
        rows, listed = (
            told(table, *mixtures[name.split("-")[0]]) for table in (rows, contacts[:, [0, 1, 2, 5, 6, 7, 8]])
        )
        assert np.array_equal(rows[:, :3], listed[:, :3]), name
        assert np.abs(rows - listed).max() < 1e-12 * max(scale, 1.0), name

        on_wall = np.isin(contacts[:, 3], WALLS) & (contacts[:, 4] < 3)
        by_wall = np.isin(contacts[:, 4], WALLS) & (contacts[:, 3] < 3)
        force = contacts[on_wall, 5:7].sum(axis=0) - contacts[by_wall, 5:7].sum(axis=0)
        assert [wx, wy, -dx, -dy] == pytest.approx([*force, *force], abs=1e-12 * scale), name
        between = contacts[on_wall | by_wall, -1].sum()
        assert [e_walls, e_droplets] == pytest.approx([between, between], rel=1e-12, abs=1e-15), name


NUMERICAL = """
fix slope all numdiff 1 1e-5
fix strain all numdiff/virial 1 1e-5
dump slope all custom 1 {name}.slope id fx fy f_slope[1] f_slope[2]
dump_modify slope sort id format float %.17g
thermo_style custom step pe press pxx pyy pxy fmax f_strain[*]
thermo_modify norm no press virial
"""


@pytest.mark.parametrize(
    "kinds",
    [
        pytest.param((1, 6, 2, 5), id="disk-edge"),
        pytest.param((3, 1, 4, 2), id="wall-edge", marks=pytest.mark.slow),
        pytest.param((5, 6, 5, 3), id="disk-disk"),
    ],
)
def test_forces_and_virial_are_slopes_of_the_energy(tmp_path, kinds):
    """fix numdiff and fix numdiff/virial of LAMMPS; on two ranks, where it is slow, in one form."""
    decks = []
    outlines, box = mixture(5, 0.2, 2 * kinds, width=1.75, height=1.9)
    for k, form in enumerate(FORMS):
        values = ["pxx", "pyy", "pxy", "f_strain[1]", "f_strain[2]", "f_strain[6]"]
        decks.append(deck_for(tmp_path, f"{k}", outlines, box, form, more=NUMERICAL, values=values))
    for ranks, deck in ((1, "".join(decks)), (2, decks[0])):
        for name, values in run(tmp_path, deck, ranks).items():
            forces, slopes = np.split(columns(tmp_path / f"{name.removeprefix('state-')}.slope", 9), 2, axis=1)
            assert np.abs(forces).max() > 0.1
            assert np.abs(slopes - forces).max() < 1e-6 * np.abs(forces).max(), name
            assert np.abs(values[3:] - values[:3]).max() < 1e-6 * np.abs(values[:3]).max(), name
