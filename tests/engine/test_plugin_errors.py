"""What LAMMPS says to a deck that uses the plugin wrongly: the style, the value and the remedy."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

import jamlab
from jamlab.cli.main import app
from jamlab.engine.installation import start_lammps
from jamlab.kernels.installed_files import installed
from jamlab.packing.law_parameters import CONTACT_FORMS

HEAD = """
units lj
dimension 2
boundary p p p
atom_modify map array sort 0 0.0
atom_style molecular
"""
FORCE = """
special_bonds lj/coul 1.0 1.0 1.0
bond_style line/tension
bond_coeff * 0.1
pair_style circuloline 0.25 2.0
pair_coeff * * 1.0
"""
AREA = "fix area all polygon/area 50.0 d_a0\n"
PROPERTY = "fix d_a0 all property/atom d_a0\n"


def squares(first=(1, 2, 3, 4), dimension=2):
    """Data file of two unit squares with rest area 1; `first`: atom IDs of the first one."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) + 0.5
    depth = 0.5 if dimension == 2 else 5.0
    ids = first, [k for k in range(1, 9) if k not in first]
    lines = ["squares", "", "8 atoms", "8 bonds", "1 atom types", "1 bond types"]
    lines += ["0 10 xlo xhi", "0 10 ylo yhi", f"{-depth} {depth} zlo zhi", "", "Masses", "", "1 1", "", "Atoms", ""]
    lines += [f"{ids[m][k]} {m + 1} 1 {x + 3 * m} {y} 0" for m in (0, 1) for k, (x, y) in enumerate(corners)]
    lines += ["", "Bonds", ""]
    lines += [f"{4 * m + k + 1} 1 {ids[m][k]} {ids[m][(k + 1) % 4]}" for m in (0, 1) for k in range(4)]
    lines += ["", "d_a0", "", *(f"{i} 1.0" for i in range(1, 9))]
    return "\n".join(lines) + "\n"


@pytest.fixture
def lmp():
    """A LAMMPS of its own for every test: some errors leave it unusable."""
    instance = start_lammps()
    yield instance
    instance.close()


@pytest.fixture
def refuses(lmp, tmp_path):
    """Function that reads two squares, runs a deck, and checks the message of the error in its last command."""

    def check(deck, message, data=None, head=HEAD):
        (tmp_path / "squares.data").write_text(data or squares())
        commands = head + PROPERTY + f"read_data {tmp_path / 'squares.data'} fix d_a0 NULL d_a0\n" + deck
        *before, last = [line for line in commands.splitlines() if line]
        for line in before:
            lmp.command(line)
        with pytest.raises(Exception, match=message):
            lmp.command(last)

    return check


def test_a_correct_deck_runs(lmp, tmp_path):
    """The other tests of this file differ from it in one thing each."""
    (tmp_path / "squares.data").write_text(squares())
    deck = HEAD + PROPERTY + f"read_data {tmp_path / 'squares.data'} fix d_a0 NULL d_a0\n" + FORCE + AREA + "run 0"
    for line in deck.splitlines():
        lmp.command(line)
    # two unit squares at rest area: tension alone; LAMMPS gives energies per atom in units lj
    assert lmp.get_thermo("pe") == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("", "circuloline needs: delta longest_edge"),
        ("0.25", "circuloline needs: delta longest_edge"),
        ("0.25 2.0 contact", "circuloline needs: delta longest_edge"),
        ("0.25 2.0 contact outline extra", "circuloline needs: delta longest_edge"),
        ("wide 2.0", "Expected floating point parameter instead of 'wide'"),
        ("-0.25 2.0", "delta -0.25 must be positive"),
        ("0.0 2.0", "delta 0.0 must be positive"),
        ("0.25 -2.0", "longest edge -2.0 must be positive"),
        ("0.25 2.0 form outline", "unknown keyword form, expected contact"),
        ("0.25 2.0 contact sphere", "unknown contact form sphere, use one of "),
    ],
)
def test_pair_style(refuses, arguments, message):
    """Arguments of pair_style circuloline."""
    refuses(f"pair_style circuloline {arguments}", message)


def test_plugin_and_python_list_the_same_contact_forms(lmp):
    """Both messages of the plugin that list the forms, against the list of Python."""
    for arguments, listed, separator in (
        ("0.25 2.0 contact sphere", r"contact form sphere, use one of ([\w/, ]+?) \(", ", "),
        ("0.25", r"\[contact ([\w/|]+)\]", "|"),
    ):
        with pytest.raises(Exception, match=listed) as refused:
            lmp.command(f"pair_style circuloline {arguments}")
        names = re.search(listed, str(refused.value))[1].split(separator)
        assert sorted(names) == sorted(CONTACT_FORMS)


def test_texts_list_the_contact_forms():
    """The comment of the decks' default, and the help of `jamlab jam`, which must not load numpy for the list."""
    deck = (installed("lammps_inputs") / "dp.parameters").read_text()
    help_text = CliRunner().invoke(app, ["jam", "--help"]).output
    comment = re.search(r"^variable contact .*# \[(.*)\]$", deck, re.MULTILINE)[1]
    assert comment.split(" | ") == list(CONTACT_FORMS)
    assert f"{', '.join(CONTACT_FORMS[:-1])} or {CONTACT_FORMS[-1]}." in " ".join(help_text.split())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("* *", "needs: pair_coeff i j eps"),
        ("* * 1.0 0.2 outline 3.0", "needs: pair_coeff i j eps"),
        ("* * 1.0 -0.2", "delta -0.2 must be positive"),
        ("* * 1.0 0.2 sphere", "unknown contact form sphere, use one of "),
        ("* * -1.0", "eps -1.0 must not be negative"),
        ("* * strong", "Expected floating point parameter instead of 'strong'"),
        ("1 3 1.0", "out of bounds"),
    ],
)
def test_pair_coeff(refuses, arguments, message):
    """Arguments of pair_coeff."""
    refuses(f"pair_style circuloline 0.25 2.0\npair_coeff {arguments}", message)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("*", "needs: bond_coeff type gamma"),
        ("* 0.1 0.0 0.0", "needs: bond_coeff type gamma"),
        ("* -0.1", "line/tension: gamma must not be negative"),
        ("* 0.1 -0.5", "line/tension: eta must not be negative"),
    ],
)
def test_bond_coeff(refuses, arguments, message):
    """Arguments of bond_coeff."""
    refuses(f"bond_style line/tension\nbond_coeff {arguments}", message)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("50.0", "polygon/area needs: ka a0"),
        ("50.0 d_a0 d_a0", "polygon/area needs: ka a0"),
        ("-50.0 d_a0", "ka -50.0 must not be negative"),
        ("50.0 0.0", "rest area 0.0 must be positive"),
        ("50.0 a0", "Expected floating point parameter instead of 'a0'"),
    ],
)
def test_fix_polygon_area(refuses, arguments, message):
    """Arguments of fix polygon/area."""
    refuses(f"fix area all polygon/area {arguments}", message)


def test_a_missing_property_is_named(refuses):
    """The rest area was never defined."""
    refuses(
        FORCE + "fix area all polygon/area 50.0 d_rest\nrun 0",
        "no per-atom property d_rest for rest area: use fix property/atom",
    )


def test_a_rest_area_of_zero_names_the_atom(refuses):
    """Defined, but not set."""
    message = "rest area a0 differs between the vertices of polygon 2: 1 and 0"
    refuses(FORCE + AREA + "set atom 6 d_a0 0.0\nrun 0", message)


def test_an_edge_longer_than_the_limit_names_its_atoms_and_the_remedy(refuses):
    """Only one edge of the four is too long."""
    deck = FORCE + AREA + "set atom 3 y 3.6\nset atom 4 y 3.4\nset atom 1 y 2.0\nset atom 2 y 1.5\nrun 0"
    message = "edge between atoms 2 and 3 is 2.1 long, more than the 2 that .* allows: raise its second argument"
    refuses(deck, message)


def test_compute_polygon_takes_no_arguments(refuses):
    """None at all."""
    refuses("compute shape all polygon 3", "Compute polygon takes no arguments")


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (
            "compute c all pair/local dist",
            "compute c of style pair/local knows pairs of atoms .* compute polygon/contact",
        ),
        ("compute c all pair/local dist eng force", "compute c of style pair/local knows pairs"),
        ("compute c all force/tally all", "compute c of style force/tally knows pairs of atoms"),
        ("compute c all group/group all", "does not support compute group/group"),
        ("compute c all centroid/stress/atom NULL pair", "does not support compute centroid/stress/atom"),
    ],
)
def test_what_the_styles_cannot_serve_is_refused(refuses, command, message):
    """By LAMMPS, which knows that there is no single(), or by the plugin."""
    refuses(f"{FORCE}{AREA}{command}\nrun 0", message)


def test_pair_write_is_refused(refuses, tmp_path):
    """It wrote a table of the distance between two atoms otherwise."""
    refuses(f"{FORCE}pair_write 1 1 10 r 0.1 0.2 {tmp_path / 'table'} circuloline", "does not support pair_write")


def test_pair_local_serves_atoms_that_belong_to_no_polygon(lmp, tmp_path):
    """A group without vertices."""
    (tmp_path / "squares.data").write_text(squares())
    deck = HEAD + PROPERTY + f"read_data {tmp_path / 'squares.data'} fix d_a0 NULL d_a0\n" + FORCE + AREA
    deck += "group none empty\ncompute c none pair/local dist\nrun 0"
    for line in deck.splitlines():
        lmp.command(line)


@pytest.mark.parametrize(
    ("deck", "message"),
    [
        ("compute c all polygon/contact all", "polygon/contact takes no arguments"),
        ("pair_style none\ncompute c all polygon/contact\nrun 0", "polygon/contact needs pair_style circuloline"),
    ],
)
def test_compute_polygon_contact(refuses, deck, message):
    """Arguments, and the pair style that it asks."""
    refuses(f"{FORCE}{deck}", message)


def test_compute_polygon_contact_refuses_atoms_that_changed(refuses, tmp_path):
    """The edges near a vertex are of the last run; the message says how to renew them."""
    deck = f"{FORCE}compute c all polygon/contact\nrun 0\ngroup second id 5:8\ndelete_atoms group second\n"
    refuses(f"{deck}write_dump all local {tmp_path / 'contacts'} c_c[5]", "atoms have changed since .* use run 0 first")


def test_three_dimensions_are_refused(refuses):
    """Polygons lie in a plane."""
    head = HEAD.replace("dimension 2", "dimension 3")
    refuses(FORCE + AREA, "polygon/area requires a 2d simulation", data=squares(dimension=3), head=head)
    refuses(FORCE + "run 0", "circuloline requires a 2d simulation", data=squares(dimension=3), head="clear" + head)


def test_jamlab_passes_the_message_on(random_polygons):
    """As an EngineError, with the command that met it."""
    p = random_polygons()
    with jamlab.Session(p) as session:
        with pytest.raises(jamlab.EngineError, match=r"`pair_style circuloline 0\.25`.*needs: delta longest_edge"):
            session.command("pair_style circuloline 0.25")
