"""What LAMMPS says to a deck that uses the plugin wrongly: an error that names the style or the value."""

import re

import outlines
import pytest

import jamlab
from jamlab.installed_files import installed

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


REFUSED = {  # deck -> ends of its last line that are refused; what the error names, where that is not one of its words
    "pair_style circuloline ": [
        *("", "0.25", "0.25 2.0 contact", "0.25 2.0 contact outline extra", "wide 2.0", "-0.25 2.0", "0.0 2.0"),
        *("0.25 -2.0", "0.25 2.0 form outline", "0.25 2.0 contact sphere"),
    ],
    "pair_style circuloline 0.25 2.0\npair_coeff ": [
        *("* *", "* * 1.0 0.2 outline 3.0", "* * 1.0 -0.2", "* * 1.0 0.2 sphere", "* * -1.0", "* * strong", "1 3 1.0"),
    ],
    "bond_style line/tension\nbond_coeff ": ["*", "* 0.1 0.0 0.0", "* -0.1", "* 0.1 -0.5"],
    "fix area all polygon/area ": ["50.0", "50.0 d_a0 d_a0", "-50.0 d_a0", "50.0 0.0", "50.0 a0"],
    FORCE: [
        *("compute shape all polygon 3", "compute c all polygon/contact all", "jamlab/forces all", "jamlab/forces"),
        *("jamlab/descend 1e-10", "pair_write 1 1 10 r 0.1 0.2 table circuloline"),
    ],
}
AT_SETUP = {  # commands -> what the error of `run 0` after them names
    "unfix area\nfix area all polygon/area 50.0 d_rest": "d_rest",
    "set atom 6 d_a0 0.0": "polygon 2",
    "set atom 3 y 3.6\nset atom 4 y 3.4\nset atom 1 y 2.0\nset atom 2 y 1.5": "atoms 2 and 3 is 2.1 long",
    "compute c all pair/local dist": "pair/local",
    "compute c all pair/local dist eng force": "pair/local",
    "compute c all force/tally all": "force/tally",
    "compute c all group/group all": "group/group",
    # it would need the forces of each contact on its three atoms apart
    **{f"compute c all centroid/stress/atom NULL {part}": "centroid/stress/atom" for part in ("", "pair", "fix")},
    "pair_style none\ncompute c all polygon/contact": "polygon/contact",
}


def refusal(lmp, text):
    """What LAMMPS says to commands, without the command itself."""
    with pytest.raises(Exception) as refused:
        lmp.commands_string(text)
    return str(refused.value).partition("\nLast input line")[0]


@pytest.mark.parametrize("deck", [start + end for start, ends in REFUSED.items() for end in ends])
def test_the_last_command_of_a_deck_is_refused(squares_in, deck):
    before, _, last = deck.rpartition("\n")
    squares_in.commands_string(before)
    said = refusal(squares_in, last)
    assert any(word in said for word in (*last.split(), before.rpartition(" ")[2] or "style")), said


@pytest.mark.parametrize(("commands", "named"), AT_SETUP.items())
def test_what_no_run_can_start_from_is_refused(squares_in, commands, named):
    squares_in.commands_string(FORCE + commands)
    assert named in refusal(squares_in, "run 0")


HEAT = """
neigh_modify every 1 delay 0 check no
fix move all nve
fix bath all langevin 0.1 0.1 1.0 4711
"""


def test_motion_along_z_is_refused(squares_in):
    """As soon as neighbor lists are made, with the fix that stops it; with it, nothing leaves the plane."""
    squares_in.commands_string(FORCE + HEAT + "fix plane all enforce2d\nrun 5\nunfix plane")
    said = refusal(squares_in, "run 5")
    assert re.search(r"atom \d leaves the plane, with z \S+ and vz \S+: use fix enforce2d, after", said), said
    assert refusal(squares_in, "unfix bath\nrun 0") == said
    squares_in.commands_string("set group all z 0\nvelocity all set NULL NULL 0\nrun 5")


@pytest.mark.parametrize("style", ["polygon/area", "circuloline", "line/tension"])
def test_three_dimensions_are_refused(lmp, tmp_path, style):
    (tmp_path / "squares.data").write_text(squares(depth=5.0))
    words = {"circuloline": "fix area", "line/tension": "fix area|pair_"}.get(style)
    force = re.sub(f"(?m)^({words})", "#", FORCE) if words else FORCE
    assert style in refusal(lmp, HEAD.replace("dimension 2", "dimension 3") + READ + force + "run 0")


def test_plugin_decks_and_python_list_the_same_contact_forms(lmp):
    """All but `segment`, which LAMMPS does not take."""
    deck = (installed("lammps_inputs") / "parts" / "dp").read_text()
    with pytest.raises(jamlab.InputError) as refused:
        jamlab.jam(8, "dp", law={"contact": "sphere"})
    said = [refusal(lmp, f"pair_style circuloline {words}") for words in ("0.25 2.0 contact sphere", "0.25")]
    comment = re.search(r"^variable contact .*# (.*)$", deck, re.MULTILINE)[1]
    for text in (*said, comment, str(refused.value)):
        assert all(re.search(rf"{form}(?![/\w])", text) for form in outlines.FORMS)


def test_jamlab_passes_the_message_on(random_polygons):
    """As an EngineError, with the command that met it; the session stays usable."""
    with jamlab.Session(random_polygons()) as session:
        for line in ("pair_style circuloline 0.25", "pair_style jelly 1.0"):
            with pytest.raises(jamlab.EngineError) as refused:
                session.command(line)
            assert line in str(refused.value)
