"""A strict type checker finds nothing in the code of the documentation, and what is wrong in wrong code.

`python tests/test_types_of_docs.py` prints what it finds.
"""

import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

sys.path.insert(0, str(Path(__file__).with_name("support")))  # where it runs as a script
from code_of_docs import ROOT, written

ON_PURPOSE = "ArgumentError"  # whose example is a call that is refused
WRONG = """
import numpy as np
import jamlab
p = jamlab.pack(16, 1e-3)
jamlab.jam(16, "dpp")
jamlab.jam(16, ensemble="shear")
jamlab.pack(16, 1e-3, law=2.5)
jamlab.shear_modulus(p, "finite")
jamlab.complex_modulus(p, [1.0], method="sparse")
jamlab.compress(p, 0.9, by="z")
jamlab.jam(16, start="cold", search="binary")
jamlab.measure(p, "zz")
jamlab.packing_fraction(p, "excat")
jamlab.micrograph(np.eye(9), contrast="light")
jamlab.ContactDamping(lever_arms="middle")
jamlab.quasistatic_shear(p, 0.1, direction="along")
jamlab.shear_modulus(p, direction=[0.0, 1.0]) + "text"
one: float = jamlab.shear_modulus(p, direction=[0.0, 1.0])
jamlab.read("p.h5", units="m")
""".strip().splitlines()


def errors(folder: Path, *targets: Path) -> list[str]:
    """What mypy says of files with the settings of pyproject.toml, one line each: path:line: error: text [kind]."""
    line = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml"), "--follow-imports", "silent"]
    line += ["--cache-dir", str(folder / "cache"), *map(str, targets)]
    env = os.environ | {"MYPYPATH": os.pathsep.join([str(ROOT), str(ROOT / "docs" / "extending")])}
    done = subprocess.run(line, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode < 2 and not done.stderr, done.stdout[-2000:] + done.stderr
    return [each for each in done.stdout.splitlines() if ": error:" in each]


def errors_of_docs() -> list[str]:
    """The same of all code of the documentation, each with the place where it stands."""
    with TemporaryDirectory() as made:
        folder = Path(made)
        origins = written(folder)
        assert len(origins) > 150
        example = ROOT / "docs" / "extending" / "jamlab_example"
        found = []
        for each in errors(folder, *sorted(folder.glob("*.py")), example):
            path, _, rest = each.partition(":")
            found.append(f"{origins.get(Path(path).name, path)}:{rest}" + f"  ({Path(path).stem})")
    return found


@pytest.mark.slow
def test_code_of_the_documentation_has_no_error_of_types():
    found = errors_of_docs()
    assert [each for each in found if ON_PURPOSE in each and "random_state" in each]  # else nothing was looked at
    assert not [each for each in found if ON_PURPOSE not in each]


@pytest.mark.slow
def test_a_wrong_choice_is_an_error_of_types(tmp_path):
    (tmp_path / "wrong.py").write_text("\n".join(WRONG))
    lines = {int(each.split(":")[1]) for each in errors(tmp_path, tmp_path / "wrong.py")}
    assert [WRONG[k - 1] for k in sorted(set(range(4, len(WRONG) + 1)) - lines)] == []
    assert min(lines) == 4  # calls that are right are none


@pytest.mark.slow
def test_the_script_of_forty_lines_runs(tmp_path):
    script = ROOT / "docs" / "examples" / "forty_lines.py"
    code = script.read_text().partition('"""\n\nimport')[2]
    assert 30 <= len([line for line in code.splitlines() if line.strip()]) <= 40
    env = os.environ | {"OMP_NUM_THREADS": "1", "MPLBACKEND": "agg"}
    done = subprocess.run([sys.executable, script, tmp_path], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "rheology.png").stat().st_size > 20_000
    head, *rows = (tmp_path / "moduli.csv").read_text().splitlines()
    assert head == "p,z,G,G_stderr,B" and len(rows) == 3
    mu, exponent = (float(re.search(rf"\b{name} = ([\d.]+)", done.stdout)[1]) for name in ("μ", "n"))
    assert 0.2 < mu < 0.8 and 0.2 < exponent < 0.8


if __name__ == "__main__":
    lines = errors_of_docs()
    print("\n".join(lines))
    print(dict(Counter(re.findall(r"\[([\w-]+)\]", line)[-1] for line in lines)))
