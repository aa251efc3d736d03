"""Table of what halving and doubling did, from the runs that `constant_trials` keeps."""

from __future__ import annotations

import json
import math
import os
from collections import defaultdict
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
    base = {row["scenario"]: row for row in map(json.loads, (folder / "base.jsonl").read_text().splitlines())}
    runs: dict[tuple[str, float], list[dict[str, Any]]] = defaultdict(list)
    rows = [json.loads(line) for line in (folder / "trials.jsonl").read_text().splitlines()]
    for row in rows:
        runs[row["constant"], row["factor"]].append(row)
    for name, row in base.items():  # a number seldom changes the cost: the median is that of the code as it is
        own = [each for each in rows if each["scenario"] == name and "cpu" in each]
        row["usual cpu"] = float(np.median([each["cpu"] for each in own])) if own else row["cpu"]
        row["usual calls"] = float(np.median([each["calls_ratio"] for each in own])) if own else 1.0
    return pd.DataFrame([_row(tree, each, kinds, base, runs) for each in tree.constants])


def _row(tree: Tree, constant: Constant, kinds: Any, base: Any, runs: Any) -> dict[str, Any]:
    sort = tree.sort(constant, kinds)
    row = {"constant": constant.label, "value": constant.text[:40], "sort": sort, "runs": 0, "half": "", "double": ""}
    if sort != "tunable":
        return row | {"verdict": sort}
    both = [runs.get((constant.label, factor), []) for factor in (0.5, 2.0)]
    if not all(both):
        return row | {"verdict": "not run"}
    if both[0][0]["scenario"] == "none":
        return row | {"verdict": "no run reads it"}
    found = [_effects(rows, base) for rows in both]
    row |= {"runs": len(both[0]), "half": _words(found[0]), "double": _words(found[1])}
    return row | {"verdict": _verdict(found)}


def _effects(rows: list[dict[str, Any]], base: Any) -> dict[str, Any]:
    """Over all runs of a number and factor: failures, largest change of a result, texts, converged states, cost."""
    ran = [row for row in rows if "failed" not in row]
    failed = [
        f"{row['scenario']}: {row.get('failed') or row['raised']}" for row in rows if {"failed", "raised"} & {*row}
    ]
    changes = [(row["change"], f"{row['scenario']}{row['where']}") for row in ran if row["change"] > 0]
    calls = {row["scenario"]: row["calls_ratio"] / base[row["scenario"]]["usual calls"] for row in ran}
    cpu = {}
    for row in ran:
        before = base[row["scenario"]]["usual cpu"]
        if abs(row["cpu"] - before) > max(NOISY_CPU[0] * before, NOISY_CPU[1]):
            cpu[row["scenario"]] = row["cpu"] / before
    return {
        "failed": failed,
        "change": max(changes, default=(0.0, "")),
        "bits": all(row["bits"] for row in ran),
        "words": [f"{row['scenario']}{row['words'][0]}" for row in ran if row.get("words")],
        "converged": [sum(row["converged"][k] for row in ran) for k in (0, 1)],
        "calls": max(calls.values(), key=lambda x: abs(math.log(max(x, 1e-9))), default=1.0),
        "cpu": max(cpu.values(), key=lambda x: abs(math.log(max(x, 1e-9))), default=1.0),
    }


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
    parts += [f"CPU x{effect['cpu']:.2f}"] if effect["cpu"] != 1.0 else []
    return "; ".join(parts) or "same bits"


def _verdict(found: list[dict[str, Any]]) -> str:
    """results, converged, cost, rounding or nothing: the first that half or double changes."""
    if any(each["failed"] or each["converged"][0] != each["converged"][1] for each in found):
        return "converged"
    if any(each["change"][0] > ROUNDING or each["words"] for each in found):
        return "results"
    if any(abs(each["calls"] - 1) > COST or each["cpu"] != 1.0 for each in found):
        return "cost"
    return "nothing" if all(each["bits"] for each in found) else "rounding"
