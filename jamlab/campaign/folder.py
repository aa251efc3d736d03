"""The folder of a campaign. The files in it are the only truth; there is no database.

| name                  | content                                                                            |
|-----------------------|------------------------------------------------------------------------------------|
| campaign.toml         | copy of the campaign file of the last run                                          |
| tasks/<task>.h5       | a finished task: it got this name by a rename, after its content was on the disk   |
| failed/<task>.json    | a task that cannot be done, with the reason; tried again by `--retry-failed` alone |
| damaged/<task>.<k>.h5 | a file under the name of a task that is not what was written                       |
| lock                  | held by flock while a driver works here: the kernel frees it when the driver dies  |
"""

import fcntl
import json
import os
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jamlab.campaign.task_file import damage, read_gaps
from jamlab.campaign.tasks import Task
from jamlab.errors import InputError, StorageError
from jamlab.packing.atomic_file import atomic_file, make_folder

COPY = "campaign.toml"


@dataclass(frozen=True)
class CampaignFolder:
    """Paths of a campaign and what is in them.

    Attributes:
        path: the folder; it need not exist until something is written.
    """

    path: Path

    def task_file(self, name: str) -> Path:
        """Where the finished task is, or will be."""
        return self.path / "tasks" / f"{name}.h5"

    def failure_file(self, name: str) -> Path:
        """Where the reason of a failed task is, or would be."""
        return self.path / "failed" / f"{name}.json"

    def finished(self) -> set[str]:
        """Names of the finished tasks: a listing, no file is opened."""
        return self._names("tasks", ".h5")

    def failed(self) -> set[str]:
        """Names of the failed tasks."""
        return self._names("failed", ".json") - self.finished()

    def failures(self) -> dict[str, dict[str, Any]]:
        """Failed task -> its record: label, error, reason, parameters."""
        records = {}
        for name in sorted(self.failed()):
            try:
                records[name] = json.loads(self.failure_file(name).read_text(encoding="utf-8"))
            except (OSError, ValueError):  # damaged: then all that is known is that it failed
                records[name] = {"label": name, "error": "unknown", "reason": "its record is damaged"}
        return records

    def record_failure(self, task: Task, error: BaseException) -> None:
        """Write down why a task cannot be done."""
        trace = "".join(traceback.format_exception(error))
        record = {"label": task.label, "error": type(error).__name__, "reason": str(error), "trace": trace}
        with atomic_file(self.failure_file(task.name)) as temporary:
            temporary.write_text(json.dumps({**record, "parameters": task.parameters}, indent=1), encoding="utf-8")

    def forget_failures(self, names: Iterable[str]) -> None:
        """Let failed tasks be tried again."""
        for name in names:
            self.failure_file(name).unlink(missing_ok=True)

    def damages(self, names: Iterable[str]) -> dict[str, str]:
        """Finished task -> what is wrong with its file; reads every byte."""
        found = ((name, damage(self.task_file(name), name)) for name in sorted(names))
        return {name: reason for name, reason in found if reason is not None}

    def gaps(self, names: Iterable[str]) -> dict[str, str]:
        """Finished task -> which of its states could not be made, and why; tasks without gaps are left out."""
        found = {}
        for name in sorted(names):
            parameters, missing = read_gaps(self.task_file(name))
            if missing:
                lines = "; ".join(f"{gap['state']}: {gap['reason']}" for gap in missing)
                found[name] = f"{Task(name, parameters).label} lacks {lines}"
        return found

    def move_aside(self, name: str) -> Path:
        """Move a damaged file to `damaged/`, so that its task is done again."""
        place = self.path / "damaged"
        place.mkdir(exist_ok=True)
        k = 1
        while (target := place / f"{name}.{k}.h5").exists():
            k += 1
        os.replace(self.task_file(name), target)
        return target

    def prepare(self) -> None:
        """Make the folders.

        Raises:
            StorageError: they cannot be made.
        """
        for part in ("tasks", "failed"):
            make_folder(self.path / part)

    def sweep_up(self) -> None:
        """Remove what killed workers left half-written; only under the lock."""
        for part in ("tasks", "failed"):
            for file in (self.path / part).glob(".jamlab-*.tmp"):
                file.unlink(missing_ok=True)

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Keep other drivers out; a dead driver holds no lock.

        Raises:
            StorageError: another driver works here.
        """
        with open(self.path / "lock", "a+", encoding="utf-8") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                file.seek(0)
                holder = file.read().strip() or "another process"
                raise StorageError(
                    f"{holder} works in {self.path}: wait for it, stop it, or give another folder with --out"
                ) from None
            file.seek(0)
            file.truncate()
            file.write(f"process {os.getpid()} on {os.uname().nodename}")
            file.flush()
            yield

    def keep_copy(self, campaign_file: Path) -> None:
        """Copy the campaign file into the folder, where `open_campaign(folder)` finds it."""
        copy = self.path / COPY
        content = campaign_file.read_bytes()
        if not copy.exists() or copy.read_bytes() != content:
            with atomic_file(copy) as temporary:
                temporary.write_bytes(content)

    def _names(self, part: str, ending: str) -> set[str]:
        try:
            entries = os.listdir(self.path / part)
        except FileNotFoundError:
            return set()
        except OSError as error:
            raise InputError(f"cannot read the folder {self.path / part}: {error.strerror}") from error
        return {entry[: -len(ending)] for entry in entries if entry.endswith(ending) and not entry.startswith(".")}
