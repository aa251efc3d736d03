"""Limits of memory, and processes that the kernel killed for it, as files of Linux tell them."""

import resource

import pytest

from jamlab.processes import memory
from jamlab.processes.death import describe_exit
from jamlab.processes.memory import MemoryKills, memory_limits

UNIFIED = {"line": "0::/job/step", "folder": "job/step", "limit": "memory.max", "kills": "memory.events"}
DIVIDED = {
    "line": "4:cpuacct,memory:/job/step",
    "folder": "memory/job/step",
    "limit": "memory.limit_in_bytes",
    "kills": "memory.oom_control",
}


@pytest.fixture(params=[UNIFIED, DIVIDED], ids=["version 2", "version 1"])
def group(request, tmp_path, monkeypatch):
    """A control group within another one, which has the smaller limit."""
    how, folder = request.param, tmp_path / "cgroup" / request.param["folder"]
    folder.mkdir(parents=True)
    (tmp_path / "self").write_text(f"9:name=systemd:/\n{how['line']}\n")
    (folder / how["limit"]).write_text("max\n" if how is UNIFIED else f"{2**63 - 4096}\n")
    (folder.parent / how["limit"]).write_text("3000000\n")
    (tmp_path / "vmstat").write_text("nr_free_pages 9\noom_kill 7\n")
    monkeypatch.setattr(memory, "_GROUPS", str(tmp_path / "self"))
    monkeypatch.setattr(memory, "_MOUNT", str(tmp_path / "cgroup"))
    monkeypatch.setattr(memory, "_MACHINE", str(tmp_path / "vmstat"))

    def kill(count):
        (folder / how["kills"]).write_text(f"oom_kill_disable 0\noom 3\noom_kill {count}\n")
        return folder

    return kill


def test_a_limit_is_that_of_the_groups_around(group):
    group(0)
    assert memory_limits() == "0.003 GB for its control group"


def test_a_process_that_was_killed_for_its_memory_is_told_from_others(group):
    group(1)
    kills = MemoryKills()
    assert describe_exit(-9, kills) == "signal 9 (Killed)"
    group(2)
    assert describe_exit(-15, kills) == "signal 15 (Terminated)"  # and says nothing of another one
    assert describe_exit(-9, kills).endswith("killed, out of memory, of which there are 0.003 GB for its control group")
    assert describe_exit(-9, kills) == "signal 9 (Killed)"
    assert describe_exit(3) == "exit code 3: a called function exited"


def test_a_machine_without_groups_counts_by_itself(group, tmp_path):
    (tmp_path / "self").unlink()
    kills = MemoryKills()
    group(5)
    assert not kills.rose() and memory_limits().endswith(" GB in this machine")
    (tmp_path / "vmstat").write_text("oom_kill 8\n")
    assert kills.rose()


def test_limits_of_a_shell_are_named(monkeypatch):
    limits = {resource.RLIMIT_AS: 2_000_000_000, resource.RLIMIT_CPU: 60}
    monkeypatch.setattr(resource, "getrlimit", lambda which: (limits.get(which, resource.RLIM_INFINITY),) * 2)
    assert memory_limits().endswith("2 GB for each process (ulimit -v)")
    assert "possibly out of memory" in describe_exit(-6, MemoryKills()) and "ulimit -v" in describe_exit(-6)
    assert describe_exit(-24).endswith("each process may use 60 s (ulimit -t)")
