"""A file of a user is replaced by a rename of a finished one; nothing removes it, and nothing writes into it."""

import ast
from pathlib import Path

import jamlab

ROOT = Path(jamlab.__file__).parent
OF_MODULES = {"os", "shutil"}
REMOVE = {"unlink", "remove", "rmtree", "rmdir", "removedirs", "truncate", "rename", "renames", "replace", "move"}
OF_PATHS = {"unlink", "rmdir", "touch", "symlink_to", "hardlink_to"}
WRITE = {"write_text", "write_bytes", "to_csv"}
OWN = {  # where a file is removed or written in place that no user made, or that is new
    ("campaign/deaths.py", "folder / DEATHS / name.unlink"): "records of workers that died at finished tasks",
    ("campaign/marks.py", "path.unlink"): "marks of calls that have ended",
    ("clusters/cluster.py", "log.unlink"): "empty output of jobs that this run, or a killed one, has sent",
    ("clusters/cluster.py", "logs.rmdir"): "the folder of that output, if nothing is in it",
    ("clusters/cluster.py", "path.rmdir"): "empty folders that making a job script has made",
    ("clusters/keys.py", ".open"): "a new file",
    ("storage/held_folder.py", ".open"): "the lock of a folder of this program",
    ("storage/held_folder.py", "shutil.rmtree"): "folders of this program and of killed ones",
    ("storage/scratch_folder.py", "shutil.rmtree"): "temporary folders of processes that are gone",
    ("campaign/folder.py", "os.replace"): "a damaged file of a task goes to a folder of its own",
    ("campaign/folder.py", ".open"): "locks",
    ("cli/start.py", ".open"): "streams that are closed",
    ("storage/atomic_file.py", "file.unlink"): "temporary files of writers that are gone",
    ("storage/atomic_file.py", "temporary.unlink"): "the temporary file itself",
    ("storage/atomic_file.py", "os.replace"): "the rename",
    ("campaign/folder.py", "self.failure_file(name).unlink"): "the record of a failure, once the task is finished",
}


def calls(tree):
    """Each call with the name of what is called, and of what."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            yield node, node.func.attr, ast.unparse(node.func.value)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            yield node, node.func.id, ""


def opens_to_write(node):
    words = [each.value for each in (*node.args, *(k.value for k in node.keywords)) if isinstance(each, ast.Constant)]
    return any(isinstance(each, str) and len(each) <= 3 and set(each) & set("wa+") for each in words)


def test_no_file_of_a_user_is_removed_or_written_in_place():
    found = set()
    for path in ROOT.rglob("*.py"):
        name = str(path.relative_to(ROOT))
        for node, method, of in calls(ast.parse(path.read_text())):
            target = ast.unparse(node.args[0]) if method == "to_csv" and node.args else of
            if (
                (of in OF_MODULES and method in REMOVE)
                or method in OF_PATHS
                or (method in WRITE and target != "temporary")
                or (method == "open" and of not in ("temporary", "os") and opens_to_write(node))
            ):
                found.add((name, f"{of}.{method}"))
    assert found == set(OWN)
