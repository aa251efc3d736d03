"""The example package of docs/extending, installed as an installer would do it, without one and without a network."""

import tomllib
from configparser import ConfigParser
from pathlib import Path

SOURCE = Path(__file__).parents[2] / "docs" / "extending"


def install(folder: Path, source: Path = SOURCE) -> Path:
    """Install the package into a folder, which a process then has on its path: its metadata, and a link to its code."""
    project = tomllib.loads((source / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    name = project["name"].replace("-", "_")
    info = folder / f"{name}-{project['version']}.dist-info"
    info.mkdir(parents=True)
    head = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    (info / "METADATA").write_text(head, encoding="utf-8")
    points = ConfigParser()
    points.read_dict(project["entry-points"])
    with (info / "entry_points.txt").open("w", encoding="utf-8") as file:
        points.write(file)
    (folder / name).symlink_to(source / name)
    return folder
