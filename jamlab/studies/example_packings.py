"""Example packings of both models that open the page of figures, to look through from onset to rho = 0.98.

Made by `jamlab jam --model MODEL --n 32 --seed 1` and `jamlab compress onset.h5 --to 0.98 --step 0.02`, whose settings
the files hold.
"""

from importlib import resources
from pathlib import Path

from jamlab.figures.explorer.write_page import explorer_fragment
from jamlab.figures.html_page import Section
from jamlab.packing.hdf5 import read_all, read_observables
from jamlab.plotting.palette import MODEL_STYLE

MODELS = ("sp", "dp")


def example_file(model: str) -> Path:
    """File of the packings of a model, installed with jamlab."""
    return Path(str(resources.files("jamlab.studies"))) / "reference" / f"packings_{model}.h5"


def example_sections() -> list[Section]:
    """One section for each model with an explorer of its packings."""
    sections = []
    for model in MODELS:
        path = example_file(model)
        fragment = explorer_fragment(read_all(path), observables=read_observables(path))
        sections.append(Section(f"One packing of N = 32: {MODEL_STYLE[model]['label']}", fragment=fragment))
    return sections
