"""What halving and doubling every number of jamlab's modules changes: results, converged states, cost.

    JAMLAB_RESULTS=build/constants pytest -m benchmark -s tests/benchmark_constants.py

takes an hour and goes on where it was stopped; JAMLAB_CONSTANTS, names of rooms or modules with commas, takes some.
The table goes to constants.csv of that folder; the kept one is `studies/constants.csv`.
"""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from constant_table import table
from scaled_constants import Tree

pytestmark = pytest.mark.benchmark
ROOT = Path(__file__).parents[1]


def test_every_number_is_halved_and_doubled(kept_folder):
    script = Path(__file__).parent / "support" / "constant_trials.py"
    rooms = os.environ.get("JAMLAB_CONSTANTS", "")
    subprocess.run([sys.executable, str(script), str(kept_folder), "0.3", rooms], check=True)
    found = table(kept_folder)
    found.to_csv(kept_folder / "constants.csv", index=False)
    print("\n" + found["verdict"].value_counts().to_string())
    assert not found["constant"].duplicated().any()


def test_how_many_constants_there_are():
    constants = Tree(ROOT).constants
    names = [each for each in constants if "." not in each.name]
    print(f"\n{len(names)} names in capitals at the level of modules, {sum(each.plain for each in names)} of them in a")
    print(f"statement of their own; {len(constants) - len(names)} numbers in {fields(constants)} frozen objects")
    for room, count in Counter(each.label.split(".")[0] for each in names).most_common():
        print(f"{room:15s} {count}")


def fields(constants):
    return len({(each.module, each.name.split(".")[0]) for each in constants if "." in each.name})
