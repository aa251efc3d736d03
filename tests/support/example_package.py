"""The example package of docs/extending, installed as an installer would do it, without one and without a network."""

import tomllib
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
    groups = project["entry-points"].items()
    lines = [
        f"[{group}]\n" + "".join(f"{key} = {value}\n" for key, value in points.items()) for group, points in groups
    ]
    (info / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")
    (folder / name).symlink_to(source / name)
    return folder
