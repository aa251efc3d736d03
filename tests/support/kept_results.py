"""Results of long benchmarks: each row is kept in the folder JAMLAB_RESULTS as it comes, so that a run goes on."""

import json
import os
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def kept_folder(tmp_path_factory):
    """The folder that JAMLAB_RESULTS names, else one that is thrown away."""
    path = Path(os.environ.get("JAMLAB_RESULTS") or tmp_path_factory.mktemp("results"))
    path.mkdir(parents=True, exist_ok=True)
    return path


def kept_rows(file, names, keys, make):
    """Rows of a file of JSON lines, one for each key, the fields of these names; missing ones are made."""
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    known = {tuple(row[name] for name in names): row for row in rows}
    with file.open("a") as out:
        for key in keys:
            if key not in known:
                known[key] = dict(zip(names, key, strict=True)) | make(*key)
                print(json.dumps(known[key]), file=out, flush=True)
    return [known[key] for key in keys]
