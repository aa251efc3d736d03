"""One HTML page of a campaign: for each sweep one packing to look through, means over packings, and what is done."""

from base64 import b64encode
from pathlib import Path

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.figure import Figure

from jamlab.campaign.campaign import Campaign
from jamlab.campaign.plan import SweepStatus
from jamlab.errors import InputError
from jamlab.figures.explorer.write_page import explorer_fragment, write_sections
from jamlab.figures.save_picture import picture
from jamlab.processes.progress import Progress, no_progress
from jamlab.storage.atomic_file import check_target
from jamlab.storage.verified_file import versions

MEANS = ("z", "g", "pressure")
_ALONG = {"target_pressure": "target_pressure", "onset": "d_rho", "rho": "rho"}  # column that is known -> axis
_MOST_STATES = 40  # of an explorer, so that a page of ten sweeps stays light
_MOST_PARTICLES = 4096

_LEAD = (
    "One packing of every sweep to look through, the one with the lowest seed; then means over all packings of the "
    "sweep, with standard errors of whole packings; then how many tasks are done."
)
_CAPTION = "Means over packings; the legend counts states that have no value or did not converge."


def write_campaign_page(campaign: Campaign, path: Path, progress: Progress = no_progress) -> None:
    """Write the page from the tasks that are finished by now."""
    check_target(path)
    if not campaign.finished():
        raise InputError(f"no task of {campaign.name} is finished: run `jamlab campaign run {campaign.file}` first")
    status = campaign.status()
    names = list(dict.fromkeys(sweep.sweep for sweep in status.sweeps))
    sections = []
    for k, name in enumerate(names):
        sections.append(_section(campaign, name, [s for s in status.sweeps if s.sweep == name]))
        progress((k + 1) / len(names), name)
    facts = {"tasks finished": f"{status.finished} of {status.tasks}", "failed": str(status.failed), **versions()}
    write_sections(path, f"Campaign {campaign.name}", _LEAD, list(zip(names, sections, strict=True)), facts)


def _section(campaign: Campaign, name: str, parts: list[SweepStatus]) -> Markup:
    columns = ("model", "n", "tasks", "finished", "failed", "left")
    table = pd.DataFrame([{column: getattr(part, column) for column in columns} for part in parts])
    html = Markup('<div class="wide">{}</div>').format(Markup(table.to_html(index=False, border=0)))
    states = campaign.table("states", name) if campaign.finished(name) else None
    if states is None or not len(states):
        return html
    packings = campaign.packings(states["task"].iloc[0])
    fragment = Markup("<p>{} particles: too many to draw here, `jamlab explore` does.</p>").format(packings[0].n)
    if packings[0].n <= _MOST_PARTICLES:
        fragment = explorer_fragment(packings, every=-(-len(packings) // _MOST_STATES))
    along = next(known for column, known in _ALONG.items() if np.isfinite(states[column]).any())
    if means := [column for column in MEANS if np.isfinite(states[column]).any()]:
        figure = Figure(figsize=(4.8 * len(means), 4.0), layout="constrained")
        for axes, column in zip(figure.subplots(1, len(means), squeeze=False)[0], means, strict=True):
            campaign.plot(column, along=along, by="n", sweep=name, ax=axes)
        shown = b64encode(picture(figure)).decode("ascii")
        fragment += Markup('<div class="wide"><img src="data:image/png;base64,{}" alt="means"></div>').format(shown)
        fragment += Markup("<p>{}</p>").format(_CAPTION)
    return fragment + html
