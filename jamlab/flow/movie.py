"""A film of a flow or of a sweep: the packing with its contact forces, and beside it the stress as it goes."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.figure import Figure

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import EngineError, InputError
from jamlab.flow.flow_run import FlowRun
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.stiffness import pressure
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import in_unit, label_axes
from jamlab.plotting.palette import BLUE, RED
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.formats import check_ending

_INCHES, _DPI = (10.0, 5.0), 100  # 1000 x 500 pixels: even numbers, which video needs


@checked
def write_movie(path: str | os.PathLike[str], run: FlowRun | Sequence[Packing], *, fps: int = 10) -> int:
    """Write a movie of packings with contact forces next to the curve of the run.

    The curve of a flow shows shear stress over strain, the curve of a sweep (list of packings) its pressure over the
    packing fraction. Repulsive contacts are blue, attractive ones red; their width is the force over the mean force of
    the packing. The frames of a flow are its stored packings, see `snapshot_every` of `shear`.

    Args:
        path: .gif, or .mp4 (needs ffmpeg, or the package imageio-ffmpeg).
        run: result of a flow or of quasi-static shear, or two packings or more.
        fps: frames per second, up to 120.

    Returns:
        The number of frames.

    Raises:
        InputError: fewer than two packings, another ending, or no ffmpeg.
        EngineError: ffmpeg fails, for example without the codec h264.
        StorageError: the file cannot be written.

    Example:
        >>> sweep = jamlab.compress(jamlab.jam(n=16, seed=1), to=0.9, step=0.02)
        >>> jamlab.write_movie("sweep.gif", list(sweep))
        4
    """
    check_ending(path, "movie")
    packings = list(run.frames if isinstance(run, FlowRun) else run)
    if len(packings) < 2:
        kept = "store packings of the flow with snapshot_every=..." if isinstance(run, FlowRun) else "give two or more"
        raise InputError(f"run has {len(packings)} packing(s), but a movie needs two or more: {kept}")
    writer = _writer(Path(path), fps)
    figure = Figure(figsize=_INCHES)
    left, right = figure.add_axes((0.02, 0.03, 0.46, 0.94)), figure.add_axes((0.6, 0.13, 0.37, 0.8))
    at = _draw_curve(right, run, packings)
    (dot,) = right.plot([], [], "o", color=RED, markersize=9)
    limits = [_draw_frame(left, packing) for packing in packings]
    widest = np.array([np.min(limits, axis=0)[:, 0], np.max(limits, axis=0)[:, 1]]).T
    with atomic_file(path) as temporary, tempfile.TemporaryDirectory(dir=temporary.parent) as folder:
        film = Path(folder) / f"film{Path(path).suffix.lower() or '.gif'}"  # writers go by the ending
        try:
            with writer.saving(figure, str(film), _DPI):
                for packing, place in zip(packings, at, strict=True):
                    _draw_frame(left, packing)
                    left.set_xlim(*widest[0])
                    left.set_ylim(*widest[1])
                    dot.set_data([place[0]], [place[1]])
                    writer.grab_frame()
        except (subprocess.CalledProcessError, BrokenPipeError) as error:
            said = str(getattr(error, "stderr", "") or error).strip()
            raise EngineError(f"{path}: ffmpeg stopped ({said}): install one with h264, or write a .gif") from error
        film.replace(temporary)
    return len(packings)


def _writer(path: Path, fps: int) -> AbstractMovieWriter:
    if path.suffix.lower() != ".mp4":
        return PillowWriter(fps=fps)
    if not FFMpegWriter.isAvailable():
        try:
            from imageio_ffmpeg import get_ffmpeg_exe

            matplotlib.rcParams["animation.ffmpeg_path"] = get_ffmpeg_exe()
        except (ImportError, RuntimeError) as error:
            raise InputError(f"{path}: no ffmpeg; run `pip install imageio-ffmpeg`, or write a .gif") from error
    return FFMpegWriter(fps=fps, codec="h264", extra_args=["-pix_fmt", "yuv420p"])


def _draw_curve(axes: Any, run: FlowRun | Sequence[Packing], packings: Sequence[Packing]) -> Array:
    """Draw the curve; (frames, 2) where each packing is on it."""
    unit = packings[0].unit_names.stress
    if isinstance(run, FlowRun):
        row = run.frame_rows
        x, y = run.strain, run.stress
        at = np.column_stack([x[row], y[row]])
        label_axes(axes, r"strain $\gamma$", in_unit(r"shear stress $\sigma$", unit))
    else:
        x, y = np.array([p.phi for p in packings]), np.array([pressure(p) for p in packings])
        at = np.column_stack([x, y])
        label_axes(axes, r"nominal packing fraction $\phi$", in_unit("pressure $p$", unit))
    axes.plot(x, y, color=BLUE, marker="." if len(x) < 100 else "")
    return at


def _draw_frame(axes: Any, packing: Packing) -> list[tuple[float, float]]:
    """Draw one packing; limits of x and y that hold it."""
    axes.clear()
    contacts(packing).plot(axes)
    legend = axes.get_legend()
    if legend is not None:
        legend.remove()
    return [axes.get_xlim(), axes.get_ylim()]
