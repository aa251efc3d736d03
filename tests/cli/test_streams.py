"""Whatever the shell gives for output: encodings without Greek letters, closed streams, a full device."""

import os
import subprocess
import sys

import pytest

import jamlab
from jamlab.cli.start import plain

JAMLAB = f"{sys.executable} -m jamlab.cli"


def shell(folder, line, **environment):
    """Run a line of the shell."""
    given = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)} | environment
    return subprocess.run(["/bin/sh", "-c", line], cwd=folder, env=given, capture_output=True, timeout=120, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("streams")
    jamlab.write(folder / "p.h5", jamlab.pack(n=8, pressure=2e-2, seed=1))
    return folder


@pytest.mark.parametrize(
    ("letter", "text"), [*zip("ρφωτ1±é−₁μ", ("rho phi omega tau 1 +- e - 1 mu").split(), strict=True), ("漢", "?")]
)
def test_letters_have_a_name_in_ascii(letter, text):
    assert plain(letter) == text


SLOW = pytest.mark.slow


@pytest.mark.parametrize("encoding", ["ascii", pytest.param("latin-1", marks=SLOW)])
def test_a_table_is_printed_in_any_encoding(folder, encoding):
    done = shell(folder, f"{JAMLAB} analyze p.h5", PYTHONIOENCODING=encoding)
    assert (done.returncode, done.stderr) == (0, b"") and b"rho" in done.stdout and b"phi" in done.stdout


@pytest.mark.parametrize("closed", [*(pytest.param(each, marks=SLOW) for each in (">&-", "2>&-")), ">&- 2>&- <&-"])
def test_closed_streams_lead_nowhere(folder, closed):
    """Nothing printed lands in the file that would have taken the place of the stream."""
    done = shell(folder, f"rm -f q.h5; {JAMLAB} convert p.h5 q.h5 {closed}")
    assert (done.returncode, done.stderr) == (0, b"")
    assert jamlab.read(folder / "q.h5") == jamlab.read(folder / "p.h5")
    if closed == "2>&-":
        done = shell(folder, f"{JAMLAB} convert p.h5 q.h5 {closed}")
        assert (done.returncode, done.stdout, done.stderr) == (1, b"", b"")


@pytest.mark.parametrize("words", [pytest.param("convert p.h5 full.h5", marks=SLOW), "--help"])
def test_a_full_device_is_one_line(folder, words):
    done = shell(folder, f"{JAMLAB} {words} > /dev/full")
    assert done.returncode == 1 and done.stderr.count(b"\n") == 1 and b"No space left" in done.stderr
