"""
The explorer
============

A page to look through a sweep: a slider through the states, force network, voids, cells and displacements, and the
values of the contact or particle under the pointer. It needs no network and no server.
"""

from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import jamlab

onset = jamlab.jam(model="dp", n=32, seed=1, ensemble="shear-stabilized")
sweep = [onset, *jamlab.compress(onset, to=0.95, step=0.02)]
with TemporaryDirectory() as folder:
    jamlab.write_page(Path(folder, "page.html"), sweep)
    page = Path(folder, "page.html").read_text(encoding="utf-8")


# %%
# The page, within this one:


class Frame:
    """A page within a page."""

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(page)}" title="explorer" style="width: 100%; height: 1100px; border: 0"></iframe>'
        )


Frame()

# %%
# One of its states, drawn by matplotlib.

ax = sweep[-1].plot()
