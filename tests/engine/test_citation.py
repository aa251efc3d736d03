"""The paper that LAMMPS asks users of the pair style to cite."""

import subprocess
import sys
from pathlib import Path

INPUT = """units lj
dimension 2
atom_style molecular
region b block 0 1 0 1 -0.5 0.5
create_box 1 b
mass * 1
{style}run 0
"""
STYLE = "pair_style circuloline 0.25 2.0\n"


def log_of(folder, style):
    """Log file of a run of no steps."""
    line = [str(Path(sys.executable).parent / "lmp"), "-log", "log"]
    subprocess.run(
        line, input=INPUT.format(style=style), cwd=folder, capture_output=True, text=True, timeout=60, check=True
    )
    return (folder / "log").read_text()


def test_the_paper_is_listed_once_and_only_with_the_style(tmp_path):
    """However often the style is made, and inside pair_style hybrid too."""
    assert "10.1039/C9SM00775J" not in log_of(tmp_path, "pair_style zero 1.0\npair_coeff * *\n")
    for style in (2 * STYLE, STYLE.replace("circuloline", "hybrid circuloline")):
        pair = "pair_coeff * * circuloline 1.0\n" if "hybrid" in style else "pair_coeff * * 1.0\n"
        bond = "special_bonds lj/coul 1 1 1\n"
        text = log_of(tmp_path, bond + style + pair)
        assert text.count("@Article{Boromand2019,") == 1, text
        assert text.count("doi =     {10.1039/C9SM00775J}") == 1


def test_the_paper_of_the_drag_is_listed_once(tmp_path):
    text = log_of(tmp_path, 2 * "pair_style disk/drag 1 1\n" + "pair_coeff * * 1 1\n")
    assert text.count("10.1039/C7SM01619K}") == 1
