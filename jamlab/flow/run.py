"""The frame of every flow: rows and packings up to a result, and the HDF5 file from which a stopped run resumes.

`RunFile` is a result that grows, with its file; `Run` has rows and packings; `TimedRun` drives a packing in time, and
quasi-static shear has a `Run` of its own.

The file is one of packings, laid out as in `jamlab.packing.hdf5`: `jamlab.read`, `jamlab explore` and MDAnalysis open
it, and its frames are the packings of the run. Beside them stands the group /flow: a dataset for each array of the
result, and as attributes `kind`, the name of its class, `facts`, all else in JSON, `damping`, and `task`, what was
asked for, by which a run is known again.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError, InputError, StorageError, typed, warn
from jamlab.flow.flow_run import FLOW_ENERGY, FlowResult, FlowRun
from jamlab.flow.overdamped_session import ON_WALLS, End, FlowState, OverdampedSession
from jamlab.geometry.contact_network import CONTACTS_DEFINITION, contacts
from jamlab.mechanics.force_network import check_at_rest
from jamlab.packing.hdf5 import file_image, read_all_hdf5
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress, told
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw, law_of_record
from jamlab.storage.atomic_file import atomic_file, check_target
from jamlab.storage.formats import check_ending
from jamlab.storage.verified_file import REMEDY, FilePath, add_checksum, dataset, opened

T = TypeVar("T", bound=FlowResult)
R = TypeVar("R", bound=FlowRun)


@dataclass(frozen=True)
class FileSteps:
    """Rows and versions of the file of a flow."""

    every: float = 10.0  # s between two versions of a file
    spacing: float = 0.05  # steps between rows that are evenly spaced in log time, over the steps so far


RECORD = FileSteps()

_NO_DRAG = {"law": "none"}  # of runs without time
REST = "give jamlab.relax(packing), or, to stop a flow, jamlab.stop_flow(packing, duration=...)"


_replacing = ContextVar("replacing", default=False)


@contextmanager
def replacing(wanted: bool = True) -> Iterator[None]:
    """Let runs take files that hold something else: the first state that is saved replaces them, by a rename."""
    before = _replacing.set(wanted)
    try:
        yield
    finally:
        _replacing.reset(before)


class RunFile(Generic[T]):
    """A result as far as it has come, and its file. `kind`: its class; `packing`: where the run starts; `damping`: None
    for a run without time; `task`: what else makes it this run, in plain numbers and text; `path`: of the file, or
    None; `progress`: that is told of it. `before`: what the file holds of the same run, or None. `facts`: entries of
    the result that do not grow; whoever drives the run sets them."""

    def __init__(
        self,
        kind: type[T],
        packing: Packing,
        damping: DragLaw | None,
        task: Mapping[str, Any],
        path: FilePath | None,
        progress: Progress | None,
    ) -> None:
        self._kind, self._path = kind, None if path is None else Path(path)
        self._task = json.dumps({**task, **_describe(damping)}, sort_keys=True)
        self._saved, self.progress = time.monotonic(), progress
        self.facts: dict[str, Any] = {"damping": damping, "unit": packing.unit_names.stress}
        self.before: T | None = None
        if self._path is None:
            return
        check_target(self._path)
        if not self._path.exists():
            check_ending(self._path, "packings")
        elif (found := self._read_same(self._path, packing)) is None and not _replacing.get():
            remedy = typed("remove it", "give --overwrite to replace it")
            raise StorageError(f"{path} exists and belongs to another run: choose another name, or {remedy}")
        else:
            self.before = found

    def result(self) -> T:
        """The run so far."""
        raise NotImplementedError

    def save(self, result: T | None = None) -> None:
        """Write a result, or the run as it is if the file has not been brought up to date for a while."""
        if self._path is None or (result is None and time.monotonic() - self._saved <= RECORD.every):
            return
        write_result(self._path, result or self.result(), self._task)
        self._saved = time.monotonic()

    def report(self, share: float, words: str) -> None:
        """Bring the file up to date, and tell the share of the work that is done."""
        self.save()
        if self.progress is not None:
            told(self.progress)(share, words)

    def finish(self) -> T:
        """Write the run as it ends, and give it."""
        last = self.result()
        self.save(last)
        return last

    def _read_same(self, path: Path, packing: Packing) -> T | None:
        try:
            with opened(path) as file:
                group = file.get("flow")
                task = None if group is None else json.loads(group.attrs.get("task", "null"))
            if task != json.loads(self._task):  # 0 is 0.0
                return None
            found: T = read_result(path, self._kind)
        except StorageError:  # damaged, no file of jamlab, or another kind of run
            return None
        first = found.frames[0]
        # LAMMPS wraps positions into its box and back, and has units of its own, which rounds
        near = 1e-9 * float(np.sqrt(packing.area / packing.n))
        same = first.difference(packing) is None and np.allclose(first.box, packing.box, rtol=1e-12, atol=near)
        return found if same and np.allclose(first.positions, packing.positions, rtol=0, atol=near) else None


def write_result(path: FilePath, result: FlowResult, task: str = "{}") -> None:
    """Write a result to a file, all or nothing. `task`: see `RunFile`."""
    # fields of a result that have a place of their own
    entries = {f.name: getattr(result, f.name) for f in fields(result) if f.name not in ("frames", "damping")}

    def add_group(file: Any) -> None:
        group = file.create_group("flow")
        rest = {name: value for name, value in entries.items() if not isinstance(value, np.ndarray)}
        for name in entries.keys() - rest.keys():
            group[name] = entries[name]
        group.attrs["kind"] = type(result).__name__
        group.attrs["contacts"] = CONTACTS_DEFINITION
        group.attrs["facts"] = json.dumps(rest)
        group.attrs["damping"] = json.dumps(_describe(result.damping))
        group.attrs["task"] = task

    marks = {name: [p.provenance.get(name, 0.0) for p in result.frames] for name in ("flow_time", "flow_strain")}
    content = add_checksum(file_image(result.frames, marks, add_group))
    with atomic_file(path) as temporary:
        temporary.write_bytes(content)


def read_result(path: FilePath, *kinds: type[Any]) -> Any:
    """Read a result of one of the classes."""
    with opened(path) as file:
        group = file.get("flow")
        kind = next((each for each in kinds if group is not None and group.attrs["kind"] == each.__name__), None)
        if kind is None:
            raise StorageError(f"{path} contains no {', '.join(each.__name__ for each in kinds)}: give another file")
        arrays = {name: dataset(group, name, "biufc")[()] for name in group}
        if "contacts" in arrays and group.attrs.get("contacts") != CONTACTS_DEFINITION:
            arrays["contacts"] = np.full(len(arrays["contacts"]), np.nan)  # counted by another definition
        facts, law = (json.loads(group.attrs[name]) for name in ("facts", "damping"))
    try:
        damping = None if law == _NO_DRAG else law_of_record(law)
        return kind(**arrays | facts | {"frames": tuple(read_all_hdf5(path)), "damping": damping})
    except (KeyError, TypeError, ValueError) as error:
        raise StorageError(f"{path} is damaged (its {kind.__name__} is incomplete: {error}): {REMEDY}") from error


def _describe(damping: DragLaw | None) -> dict[str, Any]:
    return _NO_DRAG if damping is None else damping.record()


class Run(RunFile[R]):
    """A flow of one packing, see `RunFile`; a context manager, which closes the `session` that it has."""

    session: Any

    def __init__(
        self,
        kind: type[R],
        packing: Packing,
        damping: DragLaw | None,
        task: Mapping[str, Any],
        path: FilePath | None,
        progress: Progress | None,
    ) -> None:
        super().__init__(kind, packing, damping, task, path, progress)
        self.rows: list[Any] = []
        self.frames: list[Packing] = list(self.before.frames) if self.before else []
        self._started = self.before.packing if self.before else packing
        self._steps = self.before.steps if self.before else 0
        self._began = time.perf_counter() - (self.before.seconds if self.before else 0.0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()

    @property
    def steps(self) -> int:
        """Steps so far, including the steps in the file."""
        return self._steps

    def packing(self) -> Packing:
        """The packing as it is now."""
        raise NotImplementedError

    def rows_before(self) -> list[dict[str, Any]]:
        """Rows that the file holds, by name."""
        series = self._kind.series
        columns = [getattr(self.before, name).tolist() for name in series] if self.before else [[]]
        return [dict(zip(series, row, strict=True)) for row in zip(*columns, strict=True)]

    def warn_beyond(self, name: str, reached: float, asked: float) -> None:
        """Warn if the file holds more of the run than is asked for, since all of it is returned."""
        if self.before is not None and reached > asked * (1 + 1e-9):
            warn(f"{self._path} reaches {name} = {reached:g}, beyond {asked:g}: all of the run is returned")

    def add(self, row: Any, *, keep: bool = False) -> None:
        """Add a row, and keep the packing there if asked for."""
        self.rows.append(row)
        if keep:
            self.frames.append(self.packing())

    def result(self) -> R:
        """The run so far; the last packing belongs to the last row."""
        columns = {name: np.array([getattr(row, name) for row in self.rows]) for name in self._kind.series}
        last = [] if self._last_is_kept() else [self.packing()]
        effort = {"steps": self.steps, "seconds": time.perf_counter() - self._began}
        return self._kind(**columns | effort | self.facts, frames=(*self.frames, *last))

    def _last_is_kept(self) -> bool:
        """Whether the packing of the last row is the last of the frames."""
        kept = self.frames[-1].provenance.get("flow_time", 0.0), self.frames[-1].provenance["flow_strain"]
        return kept == (self.rows[-1].time, self.rows[-1].strain)


def _differences(run: R, finer: R) -> Array:
    """(m,) largest difference of two runs of one flow so far; nan beyond the end of the other one."""
    first = run.time[1] / 2  # rows may lie evenly in the logarithm of time
    own, other = (np.log(np.maximum(each.time, first)) for each in (run, finer))
    values = np.interp(own, other, getattr(finer, run.answer))
    apart = np.maximum.accumulate(np.abs(getattr(run, run.answer) - values))
    return np.where(run.time <= finer.time[-1] * (1 + 1e-9), apart, np.nan)


class TimedRun(Run[R]):
    """A flow in time, by one session of LAMMPS. `accuracy`: tolerance, and drag beside the law's, over k tau_1; `end`:
    of the run, which is given up if it would never come there; `at_rest`: refuse a packing that is not, or in which
    nothing touches."""

    def __init__(
        self,
        kind: type[R],
        packing: Packing,
        damping: DragLaw | None,
        accuracy: tuple[float, float],
        task: Mapping[str, Any],
        end: End,
        path: FilePath | None,
        progress: Progress | None,
        *,
        at_rest: bool = False,
    ) -> None:
        if at_rest:
            check_at_rest(packing, REST)
            if contacts(packing).unjammed:
                raise InputError(
                    f"no {packing.kind.particles} touch at phi = {packing.phi:.4g}: the packing is unjammed and "
                    "has no elastic stress. Use a jammed packing, or shear it at a finite rate"
                )
        law, how = damping or ContactDamping(), dict(zip(("tolerance", "background_drag"), accuracy, strict=True))
        super().__init__(kind, packing, law, {**task, **how}, path, progress)
        self.facts |= how
        empty = dict.fromkeys(FlowState._fields, 0.0)
        self.rows = [FlowState(**empty | row) for row in self.rows_before()]
        if self.before:
            self.facts["trajectory_error"] = self.before.trajectory_error
            # of what is counted the file has the sum
            self.rows[-1] = self.rows[-1]._replace(
                iterations=float(self.before.iterations), ambiguous_contacts=float(self.before.ambiguous_contacts)
            )
            if packing.frame.has_walls:
                kept = zip(self.rows, self.before.wall_stress.reshape(-1, 4).tolist(), strict=True)
                self.rows = [row._replace(**dict(zip(ON_WALLS, on_walls, strict=True))) for row, on_walls in kept]
        self._last = self.rows[-1] if self.rows else None
        self.session: OverdampedSession = OverdampedSession(self._started, law, *accuracy, end=end)

    @property
    def steps(self) -> int:
        """Steps so far, including the steps in the file."""
        return self._steps + self.session.steps()

    @property
    def time(self) -> float:
        """Time that is reached."""
        return self.rows[-1].time if self.rows else self._last.time if self._last else 0.0

    @property
    def path(self) -> float:
        """Accumulated strain, both directions added."""
        return float(np.abs(np.diff([row.strain for row in self.rows])).sum())

    def drive(self, drive: str, interval: float, *, longest: float = 0.0) -> FlowState:
        """Drive the packing from its present state, see `OverdampedSession.drive`; the first state is the first row."""
        self._last = self.rows[-1] if self.rows else self._last
        state = self.session.drive(drive, interval, longest=longest, before=self._last)
        if not self.rows:
            self.add(state, keep=True)
        return state

    def advance(self, steps: int | None = None, *, keep: bool = False) -> FlowState:
        """Go on to the end of the interval, or by so many steps; keep the packing there if asked for."""
        state = self.session.advance(steps)
        self.add(state, keep=keep)
        return state

    def advance_log_spaced(self, end: float) -> Iterator[FlowState]:
        """Go on to a time, where the interval ends; rows lie evenly in the logarithm of the number of steps."""
        while self.rows[-1].time < end * (1 - 1e-12):
            state = self.advance(max(1, int(RECORD.spacing * self.steps)))
            self.report(state.time / end, f"time {state.time:.3g}, strain {state.strain:.3g}")
            yield state

    def measure_trajectory_error(self, again: Callable[[float, Progress], R]) -> None:
        """Run the same flow beside this one, at a tenth of its tolerance. `again`: runs it at a tolerance."""
        if len(self.facts.get("trajectory_error", ())) == len(self.rows):
            return
        self.save()
        tell = told(self.progress)
        tolerance = FLOW_ENERGY.finer * self.facts["tolerance"]

        def progress(share: float, words: str) -> None:
            tell(share, f"beside, at tolerance {tolerance:g}: {words}")

        try:
            self.facts["trajectory_error"] = _differences(self.result(), again(tolerance, progress))
        except ConvergenceError as error:
            warn(f"trajectory_error was not measured, because the run at tolerance {tolerance:g} failed: {error}")

    def begin_again(self, time: float) -> None:
        """Let the next drive continue from here, and forget the rows so far; the present time is `time` from now on."""
        self._last = self.rows[-1]._replace(time=time)
        self.rows = []

    def packing(self) -> Packing:
        """The packing as it is now, with time, strain and rate in its provenance."""
        entries: dict[str, Any] = {f"flow_{name}": getattr(self.rows[-1], name) for name in ("time", "strain", "rate")}
        if self.session.forces:  # slower than the plugin's own
            entries["flow_forces"] = f"pair_style {self.session.forces}"
        return self.session.packing().with_state(provenance=entries)

    def result(self) -> R:
        """The run so far."""
        self.facts |= {name: int(getattr(self.rows[-1], name)) for name in ("iterations", "ambiguous_contacts")}
        if self._started.frame.has_walls:
            on_walls = [[getattr(row, name) for name in ON_WALLS] for row in self.rows]
            self.facts["wall_stress"] = np.array(on_walls).reshape(-1, 2, 2)
        return super().result()
