"""A wheel that is installed, without compiler or shell: `lmp` runs an example deck, Python jams disks and droplets.

    python tests/wheel_runs_a_deck.py

Not a test of pytest: cibuildwheel runs it in the environment of every wheel.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import jamlab
from jamlab.engine.deck_files import copy_decks

LMP = Path(sys.executable).parent / "lmp"


def main() -> None:
    """Stop at the first thing that is wrong."""
    with tempfile.TemporaryDirectory() as folder:
        examples = copy_decks(Path(folder) / "decks") / "examples"
        command = [str(LMP), "-in", "in.droplets_and_disks", "-var", "steps", "1", "-log", "none"]
        environment = {"PATH": str(LMP.parent)}
        done = subprocess.run(command, cwd=examples, env=environment, capture_output=True, text=True, check=False)
        if done.returncode or "Loaded 1 plugins" not in done.stdout:
            raise SystemExit(done.stdout[-2000:] + done.stderr)
    for model in ("sp", "dp"):
        p = jamlab.jam(model=model, n=8, seed=1)
        assert p.converged, p
        print(p)


if __name__ == "__main__":
    main()
