"""Open a campaign: its text is read first, and what checks and runs it is loaded once there is one."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from jamlab.campaign.campaign_text import COPY, read_text
from jamlab.checks import checked
from jamlab.errors import InputError

if TYPE_CHECKING:
    from jamlab.campaign.campaign import Campaign


@checked
def open_campaign(path: str | os.PathLike[str], folder: str | os.PathLike[str] | None = None) -> Campaign:
    r"""Open a campaign by its TOML file, or by its folder.

    Args:
        path: the campaign file, or a folder in which a campaign has run.
        folder: folder of the tasks. Default: next to the file, with the name of the campaign.

    Raises:
        InputError: the file is not a valid campaign, or the folder contains none.

    Example:
        >>> from pathlib import Path
        >>> sweep = 'model = "sp"\nn = 16\nseeds = 4\ncompress = { to = 0.9, step = 0.02 }\n'
        >>> _ = Path("small.toml").write_text(f'name = "small"\n[[sweep]]\nname = "disks"\n{sweep}')
        >>> campaign = jamlab.open_campaign("small.toml")
        >>> campaign.name, campaign.status().left
        ('small', 4)
    """
    given = Path(path)
    if given.name == COPY and folder is None and (given.parent / "tasks").is_dir():  # the copy in a folder
        given = given.parent
    file, place = given, None if folder is None else Path(folder)
    if given.is_dir():
        if folder is not None:
            raise InputError(f"{path} is a folder already: leave out folder = {folder}")
        file, place = given / COPY, given
        if not file.is_file():
            raise InputError(f"no campaign has run in the folder {path}: give the campaign file")
    text = read_text(file)
    from jamlab.campaign.campaign import Campaign
    from jamlab.campaign.file import check_campaign
    from jamlab.campaign.folder import CampaignFolder

    content = check_campaign(text, file)
    return Campaign(file, text, content, CampaignFolder(place or given.parent / content.name))
