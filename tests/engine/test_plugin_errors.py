"""What LAMMPS says to a deck that uses the plugin wrongly: the style, the value and the remedy."""

import re

import pytest
from typer.testing import CliRunner

import jamlab
from jamlab.cli.main import app
from jamlab.kernels.installed_files import installed
from jamlab.packing.law_parameters import CONTACT_FORMS

HEAD = """
units lj
dimension 2
boundary p p p
atom_modify map array sort 0 0.0
atom_style molecular
"""
READ = """
fix d_a0 all property/atom d_a0
read_data squares.data fix d_a0 NULL d_a0
"""
FORCE = """
special_bonds lj/coul 1.0 1.0 1.0
bond_style line/tension
bond_coeff * 0.1
pair_style circuloline 0.25 2.0
pair_coeff * * 1.0
fix area all polygon/area 50.0 d_a0
"""


def squares(depth=0.5):
    """Data file of two unit squares with rest area 1."""
    lines = ["squares", "", "8 atoms", "8 bonds", "1 atom types", "1 bond types"]
    lines += ["0 10 xlo xhi", "0 10 ylo yhi", f"{-depth} {depth} zlo zhi", "", "Masses", "", "1 1", "", "Atoms", ""]
    corners = [(0.5, 0.5), (1.5, 0.5), (1.5, 1.5), (0.5, 1.5)]
    lines += [f"{4 * m + k + 1} {m + 1} 1 {x + 3 * m} {y} 0" for m in (0, 1) for k, (x, y) in enumerate(corners)]
    lines += ["", "Bonds", "", *(f"{4 * m + k + 1} 1 {4 * m + k + 1} {4 * m + (k + 1) % 4 + 1}"
                                 for m in (0, 1) for k in range(4))]  # fmt: skip
    return "\n".join([*lines, "", "d_a0", "", *(f"{i} 1.0" for i in range(1, 9))]) + "\n"


@pytest.fixture
def squares_in(lmp, tmp_path):
    """LAMMPS with two squares, on which no force acts yet."""
    (tmp_path / "squares.data").write_text(squares())
    lmp.commands_string(HEAD + READ)
    return lmp


@pytest.mark.parametrize("deck", ["run 0", "group none empty\ncompute c none pair/local dist\nrun 0"])
def test_a_correct_deck_runs(squares_in, deck):
    """The refused ones differ from it in one thing each; atoms of no polygon may have their pairs computed."""
    squares_in.commands_string(FORCE + deck)
    # two unit squares at rest area: tension alone; LAMMPS gives energies per atom in units lj
    assert squares_in.get_thermo("pe") == pytest.approx(0.1)


REFUSED = {
    "pair_style circuloline {}": [
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
    "pair_style circuloline 0.25 2.0\npair_coeff {}": [
        ("* *", "needs: pair_coeff i j eps"),
        ("* * 1.0 0.2 outline 3.0", "needs: pair_coeff i j eps"),
        ("* * 1.0 -0.2", "delta -0.2 must be positive"),
        ("* * 1.0 0.2 sphere", "unknown contact form sphere, use one of "),
        ("* * -1.0", "eps -1.0 must not be negative"),
        ("* * strong", "Expected floating point parameter instead of 'strong'"),
        ("1 3 1.0", "out of bounds"),
    ],
    "bond_style line/tension\nbond_coeff {}": [
        ("*", "needs: bond_coeff type gamma"),
        ("* 0.1 0.0 0.0", "needs: bond_coeff type gamma"),
        ("* -0.1", "line/tension: gamma must not be negative"),
        ("* 0.1 -0.5", "line/tension: eta must not be negative"),
    ],
    "fix area all polygon/area {}": [
        ("50.0", "polygon/area needs: ka a0"),
        ("50.0 d_a0 d_a0", "polygon/area needs: ka a0"),
        ("-50.0 d_a0", "ka -50.0 must not be negative"),
        ("50.0 0.0", "rest area 0.0 must be positive"),
        ("50.0 a0", "Expected floating point parameter instead of 'a0'"),
    ],
    FORCE + "{}\nrun 0": [
        (
            "unfix area\nfix area all polygon/area 50.0 d_rest",
            "no per-atom property d_rest for rest area: use fix property/atom",
        ),
        ("set atom 6 d_a0 0.0", "rest area a0 differs between the vertices of polygon 2: 1 and 0"),
        (
            "set atom 3 y 3.6\nset atom 4 y 3.4\nset atom 1 y 2.0\nset atom 2 y 1.5",
            "edge between atoms 2 and 3 is 2.1 long, more than the 2 that .* allows: raise its second argument",
        ),
        ("compute c all pair/local dist", "of style pair/local knows pairs of atoms .* compute polygon/contact"),
        ("compute c all pair/local dist eng force", "compute c of style pair/local knows pairs"),
        ("compute c all force/tally all", "compute c of style force/tally knows pairs of atoms"),
        ("compute c all group/group all", "does not support compute group/group"),
        *(
            (f"compute c all centroid/stress/atom NULL {part}", "does not support compute centroid/stress/atom")
            for part in ("", "pair", "fix")
        ),  # it would need the forces of each contact on its three atoms apart
        ("pair_style none\ncompute c all polygon/contact", "polygon/contact needs pair_style circuloline"),
    ],
    FORCE + "{}": [
        ("compute shape all polygon 3", "Compute polygon takes no arguments"),
        ("compute c all polygon/contact all", "polygon/contact takes no arguments"),
        ("jamlab/forces all", "jamlab/forces takes no arguments"),
        ("jamlab/forces", "continues a run: use run 0 first"),
        ("jamlab/descend 1e-10", "jamlab/descend needs 15 numbers"),
        # it wrote a table of the distance between two atoms otherwise
        ("pair_write 1 1 10 r 0.1 0.2 table circuloline", "does not support pair_write"),
        # the edges near a vertex are of the last run
        (
            "compute c all polygon/contact\nrun 0\ngroup second id 5:8\ndelete_atoms group second\n"
            "write_dump all local contacts c_c[5]",
            "atoms have changed since .* use run 0 first",
        ),
    ],
}


@pytest.mark.parametrize(
    ("deck", "message"), [(deck.format(words), message) for deck, rows in REFUSED.items() for words, message in rows]
)
def test_the_last_command_of_a_deck_is_refused(squares_in, deck, message):
    *before, last = [line for line in deck.splitlines() if line]
    for line in before:
        squares_in.command(line)
    with pytest.raises(Exception, match=message):
        squares_in.command(last)


@pytest.mark.parametrize("style", ["polygon/area", "circuloline"])
def test_three_dimensions_are_refused(lmp, tmp_path, style):
    (tmp_path / "squares.data").write_text(squares(depth=5.0))
    force = FORCE.replace("fix area", "#") if style == "circuloline" else FORCE
    with pytest.raises(Exception, match=f"{style} requires a 2d simulation"):
        lmp.commands_string(HEAD.replace("dimension 2", "dimension 3") + READ + force + "run 0")


def test_plugin_and_python_list_the_same_contact_forms(lmp):
    """Both messages of the plugin that list the forms, against the list of Python."""
    for arguments, listed, separator in (
        ("0.25 2.0 contact sphere", r"contact form sphere, use one of ([\w/, ]+?) \(", ", "),
        ("0.25", r"\[contact ([\w/|]+)\]", "|"),
    ):
        with pytest.raises(Exception, match=listed) as refused:
            lmp.command(f"pair_style circuloline {arguments}")
        names = re.search(listed, str(refused.value))[1].split(separator)
        assert tuple(names) == CONTACT_FORMS  # their places are numbers in data files and of kernels


def test_texts_list_the_contact_forms():
    """The comment of the decks' default, and the help of `jamlab jam`, which must not load numpy for the list."""
    deck = (installed("lammps_inputs") / "parts" / "dp").read_text()
    help_text = CliRunner().invoke(app, ["jam", "--help"]).output
    comment = re.search(r"^variable contact .*# (.*)$", deck, re.MULTILINE)[1]
    assert comment.split(" | ") == list(CONTACT_FORMS)
    assert f"{', '.join(CONTACT_FORMS[:-1])} or {CONTACT_FORMS[-1]}." in " ".join(help_text.split())


def test_jamlab_passes_the_message_on(random_polygons):
    """As an EngineError, with the command that met it; the session stays usable."""
    with jamlab.Session(random_polygons()) as session:
        with pytest.raises(jamlab.EngineError, match=r"`pair_style circuloline 0\.25`.*needs: delta longest_edge"):
            session.command("pair_style circuloline 0.25")
        with pytest.raises(jamlab.EngineError, match=r"`pair_style jelly 1\.0`.*[Uu]nrecognized pair style 'jelly'"):
            session.command("pair_style jelly 1.0")
