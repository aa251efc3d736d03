"""Modules of observables of one's own, in a worker that is older than their files or serves several campaigns."""

import sys

import pytest

from jamlab.campaign.observable import load_function
from jamlab.errors import InputError


@pytest.fixture(autouse=True)
def forgotten():
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        del sys.modules[name]


def write(folder, text, name="counted_here"):
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.py").write_text(text)
    return [str(folder)]


def test_a_module_that_has_changed_is_read_again(tmp_path):
    text = "COUNT = 0\n\ndef value(packing):\n    global COUNT\n    COUNT += 1\n    return COUNT\n"
    folders = write(tmp_path, text)
    assert [load_function("counted_here:value", folders)(None) for _ in range(3)] == [1, 2, 3]  # imported once
    write(tmp_path, text.replace("return COUNT", "return -COUNT"))
    assert load_function("counted_here:value", folders)(None) == -1
    (tmp_path / "counted_here.py").unlink()
    with pytest.raises(InputError, match="counted_here"):
        load_function("counted_here:value", folders)


def test_campaigns_with_modules_of_one_name_have_each_its_own(tmp_path):
    places = [write(tmp_path / str(k), f"def value(packing):\n    return {k}\n") for k in range(2)]
    assert [load_function("counted_here:value", places[k])(None) for k in (0, 1, 0, 1)] == [0, 1, 0, 1]


def test_a_module_of_python_itself_is_not_replaced(tmp_path):
    import statistics

    with pytest.raises(InputError, match="value"):
        load_function("statistics:value", write(tmp_path, "def value(packing):\n    return 1.0\n", "statistics"))
    assert sys.modules["statistics"] is statistics
