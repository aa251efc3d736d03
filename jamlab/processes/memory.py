"""How much memory this process may use, and whether the kernel killed processes for it."""

import os
import resource

_GROUPS = "/proc/self/cgroup"
_MOUNT = "/sys/fs/cgroup"
_MACHINE = "/proc/vmstat"


class MemoryKills:
    """Processes of this control group, or of a machine without one, that the kernel killed for their memory."""

    def __init__(self) -> None:
        self._before = _count_kills()

    def rose(self) -> bool:
        """Whether there is another one since the last look."""
        before, self._before = self._before, _count_kills()
        return self._before > before


def memory_limits() -> str:
    """Limits of the memory of this process, as text: those that are set, else what the machine has."""
    limits = []
    group = min(_of_groups("memory.max", "memory.limit_in_bytes"), default=_whole_memory())
    if group < _whole_memory():  # version 1 says 2**63 for no limit
        limits.append(f"{group / 1e9:.3g} GB for its control group")
    for which, words in ((resource.RLIMIT_AS, "ulimit -v"), (resource.RLIMIT_DATA, "ulimit -d")):
        most = resource.getrlimit(which)[0]
        if most != resource.RLIM_INFINITY:
            limits.append(f"{most / 1e9:.3g} GB for each process ({words})")
    return " and ".join(limits) or f"{_whole_memory() / 1e9:.3g} GB in this machine"


def _whole_memory() -> int:
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def _count_kills() -> int:
    kills = _of_groups("memory.events", "memory.oom_control")
    return kills[0] if kills else _number(_MACHINE, "oom_kill") or 0


def _of_groups(unified: str, divided: str) -> list[int]:
    """A number of the control group of this process, and of those that hold it, where they have one: by its file in
    version 2 of control groups, and in version 1."""
    found = []
    for top, name in ((_MOUNT, unified), (os.path.join(_MOUNT, "memory"), divided)):
        folder = _group(top)
        while folder.startswith(top):
            found.append(_number(os.path.join(folder, name), "oom_kill"))
            folder = os.path.dirname(folder)
    return [number for number in found if number is not None]


def _group(top: str) -> str:
    """Folder of the control group of this process; a container may see its own group as the uppermost one. "" if there
    is none."""
    controller = "" if top == _MOUNT else os.path.basename(top)
    for line in _read(_GROUPS).splitlines():
        _, controllers, path = line.split(":", 2)
        if controller in controllers.split(","):
            folder = os.path.join(top, path.strip("/")).rstrip("/")
            return folder if os.path.isdir(folder) else top
    return ""


def _read(path: str) -> str:
    try:
        with open(path) as file:
            return file.read()
    except OSError:
        return ""


def _number(path: str, name: str) -> int | None:
    """The number of a file that holds one, or that which stands behind a name; None if there is none."""
    words = _read(path).split()
    text = words[words.index(name) + 1] if name in words else "".join(words)
    return int(text) if text.isdecimal() else None
