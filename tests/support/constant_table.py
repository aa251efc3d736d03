"""Table of what halving and doubling did, from the runs that `constant_trials` keeps."""

from __future__ import annotations

import json
import math
import os
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scaled_constants import Constant, Tree

ROUNDING = 1e-9  # relative change of a result, up to which it counts as the same
COST = 0.1  # change of cost that counts
NOISY_CPU = 0.3, 0.05  # relative change of CPU time, and seconds, that the load of a machine does not explain


def table(folder: Path) -> pd.DataFrame:
    """One row for each constant and field: what it is, which runs read it, what half and double change, a verdict."""
    tree = Tree(Path(os.environ.get("JAMLAB_TREE") or Path(__file__).parents[2]))
    kinds = json.loads((folder / "modules.json").read_text())["kinds"]
    plain = {each.label: tree.is_plain(each) for each in tree.constants}  # the others are imported anew, which costs
    runs: dict[tuple[str, float], list[dict[str, Any]]] = defaultdict(list)
    for row in map(json.loads, (folder / "trials.jsonl").read_text().splitlines()):
        own = runs[row["constant"], row["factor"]]
        if own and own[0]["scenario"] == "none":  # read by none then, by some of a longer battery
            own.clear()
        own.append(row | {"usual": (row["scenario"], bool(own), plain[row["constant"]])})  # first runs cost more
    usual = _usual_cost([row for own in runs.values() for row in own if "cpu" in row])
    return pd.DataFrame([_row(tree, each, kinds, usual, runs) for each in tree.constants])


def _row(tree: Tree, constant: Constant, kinds: Any, usual: Any, runs: Any) -> dict[str, Any]:
    sort = tree.sort(constant, kinds)
    row = {"constant": constant.label, "value": constant.text[:40], "sort": sort, "runs": 0, "half": "", "double": ""}
    if sort != "tunable":
        return row | {"verdict": sort}
    both = [runs.get((constant.label, factor), []) for factor in (0.5, 2.0)]
    if not all(both):
        return row | {"verdict": "not run"}
    if both[0][0]["scenario"] == "none":
        return row | {"verdict": "no run reads it"}
    found = [_effects(rows, usual) for rows in both]
    row |= {"runs": len(both[0]), "half": _words(found[0]), "double": _words(found[1])}
    return row | {"verdict": _verdict(found)}


def _effects(rows: list[dict[str, Any]], usual: Any) -> dict[str, Any]:
    """Over all runs of a number and factor: failures, largest change of a result, texts, converged states, cost."""
    ran = [row for row in rows if "failed" not in row]
    failed = [
        f"{row['scenario']}: {row.get('failed') or row['raised']}" for row in rows if {"failed", "raised"} & {*row}
    ]
    changes = [(row["change"], f"{row['scenario']}{row['where']}") for row in ran if row["change"] > 0]
    calls = [row["calls_ratio"] / usual[row["usual"]][0] for row in ran]
    cpu = {row["scenario"]: (row["cpu"], usual[row["usual"]][1]) for row in ran}
    return {
        "failed": failed,
        "change": max(changes, default=(0.0, "")),
        "bits": all(row["bits"] for row in ran),
        "words": [f"{row['scenario']}{row['words'][0]}" for row in ran if row.get("words")],
        "converged": [sum(row["converged"][k] for row in ran) for k in (0, 1)],
        "calls": max(calls, key=_size, default=1.0),
        "cpu": cpu,
    }


def _usual_cost(rows: list[dict[str, Any]]) -> dict[Any, tuple[float, float]]:
    """Calls over those of the first run, and CPU seconds: medians over all numbers, of which few change the cost."""
    own = defaultdict(list)
    for row in rows:
        own[row["usual"]].append((row["calls_ratio"], row["cpu"]))
    return {key: (float(np.median(calls)), float(np.median(cpu))) for key, (calls, cpu) in _columns(own)}


def _columns(own: dict[Any, list[tuple[float, float]]]) -> Iterator[tuple[Any, Any]]:
    for key, values in own.items():
        yield key, tuple(zip(*values, strict=True))


def _size(ratio: float) -> float:
    return abs(math.log(max(ratio, 1e-9)))


def _slower(half: dict[str, Any], double: dict[str, Any]) -> bool:
    """Whether CPU time goes one way with the number, by more than the load of a machine explains."""
    for name in half["cpu"].keys() & double["cpu"].keys():
        (one, usual), (other, _) = half["cpu"][name], double["cpu"][name]
        least = max(NOISY_CPU[0] * usual, NOISY_CPU[1])
        if abs(one - other) > least and max(abs(one - usual), abs(other - usual)) > least:
            return True
    return False


def _words(effect: dict[str, Any]) -> str:
    parts = [effect["failed"][0][:90]] if effect["failed"] else []
    change, where = effect["change"]
    if change:
        parts.append(f"{change:.1g} of {where}")
    elif effect["words"]:
        parts.append(f"words of {effect['words'][0]}")
    elif not effect["bits"]:
        parts.append("bits")
    before, after = effect["converged"]
    parts += [f"converged {before} -> {after}"] if before != after else []
    parts += [f"calls x{effect['calls']:.2f}"] if abs(effect["calls"] - 1) > COST else []
    return "; ".join(parts) or "same bits"


def _verdict(found: list[dict[str, Any]]) -> str:
    """results, converged, cost, rounding or nothing: the first that half or double changes."""
    if any(each["failed"] or each["converged"][0] != each["converged"][1] for each in found):
        return "converged"
    if any(each["change"][0] > ROUNDING or each["words"] for each in found):
        return "results"
    if any(abs(each["calls"] - 1) > COST for each in found) or _slower(*found):
        return "cost"
    return "nothing" if all(each["bits"] for each in found) else "rounding"
