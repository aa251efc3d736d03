"""Write the general part of the plugin as a package of LAMMPS: python plugin/lammps_package.py FOLDER

FOLDER gets what a pull request would add to LAMMPS' tree: src/POLYGON, doc/src, examples/PACKAGES/polygon,
unittest/force-styles/tests, and lines_to_add.txt, which says what else changes there. A person fills in the author.
"""

import re
import sys
from pathlib import Path

SOURCE = Path(__file__).parent
ROOT = SOURCE.parent
STYLES = {  # header: macro of registration, style, class
    "pair_circuloline": ("Pair", "circuloline", "PairCirculoline"),
    "bond_line_tension": ("Bond", "line/tension", "BondLineTension"),
    "fix_polygon_area": ("Fix", "polygon/area", "FixPolygonArea"),
    "fix_polygon_outline": ("Fix", "POLYGON/OUTLINE", "FixPolygonOutline"),  # upper case: LAMMPS' own, not for inputs
    "compute_polygon": ("Compute", "polygon", "ComputePolygon"),
    "compute_polygon_contact": ("Compute", "polygon/contact", "ComputePolygonContact"),
    "compute_polygon_group_group": ("Compute", "polygon/group/group", "ComputePolygonGroupGroup"),
}
PAGES = [name for name in STYLES if name != "fix_polygon_outline"]
HEADER = """\
// clang-format off
/* ----------------------------------------------------------------------
   LAMMPS, package POLYGON: deformable polygons, walls and disks
   https://www.lammps.org/, LAMMPS development team: developers@lammps.org

   This software is distributed under the GNU General Public License.
   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

/* ----------------------------------------------------------------------
   Contributing author: AUTHOR (AFFILIATION), E-MAIL
------------------------------------------------------------------------- */
// clang-format on

"""
REGISTRATION = """\
#ifdef {kind}_CLASS
// clang-format off
{macro}Style({style},{name});
// clang-format on
#else

"""
ASCII = dict(
    zip(
        "δεηγφατ²⁴₀−–×’éµ≥≤·",
        "delta epsilon eta gamma phi alpha tau ^2 ^4 _0 - - x ' e mu >= <= *".split(),
        strict=True,
    )
)
AMERICAN = {"neighbour": "neighbor", "colour": "color", "minimis": "minimiz", "centre": "center", "analyse": "analyze",
            "behaviour": "behavior", "artefact": "artifact", "grey": "gray", "modelling": "modeling"}  # fmt: skip
COMMANDS = "fix|compute|dump|region|group|molecule"


def american(text: str) -> str:
    """In ASCII letters and American spelling, with the dashes of `atom-ID`, as LAMMPS asks."""
    for old, new in (ASCII | AMERICAN).items():
        text = text.replace(old, new)
    text = re.sub(rf"^(\s+)({COMMANDS}) ID\b", r"\1\2 \2-ID", text, flags=re.MULTILINE)
    text = re.sub(rf"(?i)\b({COMMANDS}|atom|chunk|grid) (IDs?)\b(?!\[)", r"\1-\2", text)
    text.encode("ascii")
    return text


def needed(name: str, found: set[str]) -> set[str]:
    """Files of the plugin that a style is made of, by what they include."""
    if not (SOURCE / f"{name}.h").exists():
        return found  # of LAMMPS itself
    stems = [name, *(path.stem for path in SOURCE.glob(f"{name}_*.cpp") if not path.with_suffix(".h").exists())]
    for path in (SOURCE / f"{stem}{end}" for stem in stems for end in (".h", ".cpp")):
        if path.exists() and path.name not in found:
            found.add(path.name)
            for other in re.findall(r'#include "(\w+)\.h"', path.read_text()):
                needed(other, found)
    return found


def source(name: str) -> str:
    """A file of the plugin with LAMMPS' header, guard and registration."""
    text = (SOURCE / name).read_text().partition("\n\n")[2]
    text = text.replace("ComputePolygonGroup", "ComputePolygonGroupGroup")
    text = text.replace('"compute_polygon_group.h"', '"compute_polygon_group_group.h"').replace("JAMLAB_", "LMP_")
    text = re.sub(r"// The wheel.*?#if __has_include.*?#endif\n", '#include "respa.h"\n', text, flags=re.DOTALL)
    text = text.replace("LMP_COMPUTE_POLYGON_GROUP_H", "LMP_COMPUTE_POLYGON_GROUP_GROUP_H")
    stem = renamed(Path(name).stem)
    if name.endswith(".h") and stem in STYLES:
        macro, style, of_class = STYLES[stem]
        text = REGISTRATION.format(kind=macro.upper(), macro=macro, style=style, name=of_class) + text + "\n#endif\n"
    return american(HEADER + text)


def renamed(stem: str) -> str:
    """LAMMPS names a file after its style."""
    return "compute_polygon_group_group" if stem == "compute_polygon_group" else stem


def inline(text: str) -> str:
    """Marks within a line of MyST in those of reStructuredText."""
    text = re.sub(r"`([^`]+)`", r"``\1``", text)
    text = re.sub(r"\{cite:t\}``[^`]+``", "Boromand et al., Soft Matter 15, 5854 (2019),", text)
    text = re.sub(r"(?<!\$)\$([^$]+)\$(?!\$)", r":math:`\1`", text)
    text = re.sub(r"\[([^\]]+)\]\((\w+)\.md[^)]*\)", lambda m: f":doc:`{m[1].replace('`', '')} <{m[2]}>`", text)
    return re.sub(r"\[([^\]]+)\]\([^)]*\)", r"\1", text)


def table(rows: list[str]) -> str:
    """A table of MyST as list-table."""
    lines = [".. list-table::", "   :header-rows: 1", ""]
    for row in rows[:1] + rows[2:]:
        cells = [inline(cell.strip()) for cell in row.strip().strip("|").split("|")]
        lines += [f"   {'*' if k == 0 else ' '} - {cell}".rstrip() for k, cell in enumerate(cells)]
    return "\n".join(lines) + "\n"


def page(name: str) -> str:
    """The manual page of a style in reStructuredText."""
    text = (ROOT / "docs" / "reference" / "lammps" / f"{name}.md").read_text()
    title = text.partition("\n")[0].removeprefix("# ")
    out = [f".. index:: {title}", ""]
    blocks = re.split(r"(```.*?```|\$\$.*?\$\$|(?:^\|.*\n)+)", text, flags=re.DOTALL | re.MULTILINE)
    for block in blocks:
        if block.startswith("```"):
            kind, _, body = block.strip("`").partition("\n")
            indented = "".join(f"   {line}".rstrip() + "\n" for line in body.rstrip().splitlines())
            out.append(f".. code-block:: {'LAMMPS' if kind == 'text' else kind}\n\n{indented}")
        elif block.startswith("$$"):
            out.append(f".. math::\n\n   {' '.join(block.strip('$').split())}\n")
        elif block.startswith("|"):
            out.append(table(block.splitlines()))
        else:
            out += [heading(line) for line in block.splitlines()]
    out.insert(out.index("Description\n-----------") + 1, "\n.. versionadded:: TBD")
    text = re.sub(r"\n{3,}", "\n\n", "\n".join(line.rstrip() for line in "\n".join(out).splitlines()))
    return american(text.rstrip() + "\n")


def heading(line: str) -> str:
    """A line of text, or a title with its rule below."""
    marks, _, title = line.partition(" ")
    if title and set(marks) == {"#"}:
        title = f"{title} command" if marks == "#" else title
        rule = "=" if marks == "#" else "-" if marks == "##" else "^"
        return f"{title}\n{rule * len(title)}"
    return "----------" if line == "---" else inline(line)


LINES = """\
cmake/CMakeLists.txt: POLYGON in the list of STANDARD_PACKAGES; pkg_depends(POLYGON MOLECULE)
src/Makefile: polygon in PACKAGE, after plugin; src/.gitignore: the files of src/POLYGON
doc/src/Commands_pair.rst: * :doc:`circuloline <pair_circuloline>`
doc/src/Commands_bond.rst: * :doc:`line/tension <bond_line_tension>`
doc/src/Commands_fix.rst: * :doc:`polygon/area <fix_polygon_area>`
doc/src/Commands_compute.rst: * :doc:`polygon <compute_polygon>`, polygon/contact, polygon/group/group
doc/src/pair_style.rst, bond_style.rst, fix.rst, compute.rst: the same with " - " and a sentence each
doc/src/Packages.rst: a row of the table, :ref:`POLYGON <PKG-POLYGON>`
doc/src/Packages_details.rst: * :ref:`POLYGON <PKG-POLYGON>`, and a section below .. _PKG-POLYGON: with contents, the
author as its maintainer, and examples/PACKAGES/polygon
"""


def write(folder: Path) -> None:
    """All files of the package."""
    package, pages = folder / "src" / "POLYGON", folder / "doc" / "src"
    examples = folder / "examples" / "PACKAGES" / "polygon"
    tests = folder / "unittest" / "force-styles" / "tests"
    for path in (package, pages, examples, tests):
        path.mkdir(parents=True, exist_ok=True)
    files: set[str] = set()
    for name in STYLES:
        needed("compute_polygon_group" if name == "compute_polygon_group_group" else name, files)
    for name in sorted(files):
        path = Path(name)
        (package / f"{renamed(path.stem)}{path.suffix}").write_text(source(name))
    (package / "README").write_text(
        "Deformable polygons as rings of bonds, with walls and disks: contacts, line tension, area.\n\n"
        "Contributing author: AUTHOR (AFFILIATION), E-MAIL\n"
    )
    for name in PAGES:
        (pages / f"{name}.rst").write_text(page(name))
    for path in [*(ROOT / "lammps_inputs" / "examples").iterdir(), ROOT / "lammps_inputs" / "parts" / "polygon12.mol"]:
        name = f"log.22Jul2025.{path.suffix[1:]}.g++.1" if path.name.startswith("log.") else path.name
        (examples / name).write_text(american(path.read_text().replace("../parts/polygon12.mol", "polygon12.mol")))
    sys.path += [str(ROOT / "tests" / "support"), str(ROOT)]
    from force_styles import Mixture, write_all

    write_all(tests, [Mixture()])
    (folder / "lines_to_add.txt").write_text(LINES)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
