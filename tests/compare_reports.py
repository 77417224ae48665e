"""Compare two folders of reports: what is missing, and by how much numbers differ.

Compares every table (.csv, tables of .md) row by row, every value of .json, and figures by name.
Ends with status 1 if NEW lacks a file, table, column, row or value of OLD.
"""

import argparse
import json
import re
import sys
from pathlib import Path

import pandas as pd

NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.]*\w)")
ENDS = "*.[cjmp]*"  # csv, json, md, png


def main() -> None:
    """Print a line a file, with its differences below; set the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs=2, metavar=("OLD", "NEW"))
    parser.add_argument("--rtol", type=float, default=0.0, help="relative difference to ignore")
    parser.add_argument("--atol", type=float, default=0.0, help="absolute difference to ignore")
    parser.add_argument("--only-different", action="store_true", help="leave out what is equal")
    given = parser.parse_args()
    old, new = ({p.relative_to(f).as_posix() for p in f.rglob(ENDS)} for f in given.folders)
    n_missing = 0
    for name in sorted(old):
        found = compare(name, given) if name in new else ["missing: the file"]
        n_missing += sum(line.startswith("missing") for line in found)
        if found or not given.only_different:
            print("\n    ".join([f"{name}: {'differs' if found else 'equal'}", *found]))
    print(f"new files: {', '.join(sorted(new - old)) or 'none'}")
    print(f"lines that say missing: {n_missing}")
    sys.exit(n_missing > 0)


def compare(name: str, given: argparse.Namespace) -> list[str]:
    """What is missing or differs in a file that both folders have."""
    if name.endswith(".png"):
        return []
    (old, new), found = (tables(folder / name) for folder in given.folders), []
    for number, table in enumerate(old, 1):
        where = f": table {number}, " if len(old) > 1 else ": "
        match = max(new, key=lambda other: likeness(table, other), default=table[[]])
        if likeness(table, match)[0] == 0:
            found.append(f"missing: table {number} ({', '.join(table.columns)})")
        else:
            new = [other for other in new if other is not match]
            lines = compare_tables(table, match, given)
            found += [line.replace(": ", where, 1) for line in lines]
    return found


def tables(path: Path) -> list[pd.DataFrame]:
    """Tables of a file, all cells text; a .json is one of dotted keys and values."""
    if path.suffix == ".csv":
        found = [pd.read_csv(path, dtype=str, keep_default_na=False)]
    elif path.suffix == ".json":
        found = [pd.json_normalize(json.loads(path.read_text())).astype(str).melt(var_name="key")]
    else:
        blocks = re.findall(r"(?:^\|.*\n?)+", path.read_text(), re.MULTILINE)
        rows = [[re.split(r" *(?<!\\)\| *", r)[1:-1] for r in b.splitlines()] for b in blocks]
        found = [pd.DataFrame(body, columns=head) for head, _, *body in rows]
    return [table.map(lambda x: str(float(x)) if NUMBER.fullmatch(x) else x) for table in found]


def likeness(old: pd.DataFrame, new: pd.DataFrame) -> tuple[int, int]:
    """How many columns two tables have in common, and how many cells (named by the first)."""
    both = [name for name in old.columns if name in new.columns]
    rows = [table[both].to_numpy() for table in (old, new)]
    cells = [{(row[0], *cell) for row in table for cell in enumerate(row)} for table in rows]
    return len(both), len(cells[0] & cells[1])


def compare_tables(old: pd.DataFrame, new: pd.DataFrame, given: argparse.Namespace) -> list[str]:
    """Rows are matched by the fewest first columns that tell them apart, else by position."""
    found = [f"missing: column {name!r}" for name in old.columns if name not in new.columns]
    both = [name for name in old.columns if name in new.columns]
    rows = [list(range(1, len(table) + 1)) for table in (old, new)]
    for n in range(1, len(both)):
        named = [[" | ".join(r) for r in table[both[:n]].to_numpy()] for table in (old, new)]
        if all(len(set(names)) == len(names) for names in named):
            # names that are results change with them: rows that differ in numbers go by position
            shape = [[NUMBER.sub("#", name) for name in names] for names in named]
            rows = named if shape[0] != shape[1] or set(named[0]) == set(named[1]) else rows
            break
    if lost := [str(row) for row in rows[0] if row not in set(rows[1])]:
        found.append(f"missing: {len(lost)} rows: {'; '.join(lost[:8])}")
    found += [f"more: {len(new) + len(lost) - len(old)} rows"] * (len(new) + len(lost) > len(old))
    old, new = old.set_axis(rows[0]), new.set_axis(rows[1])
    for name in both:
        lines = compare_cells(old[name].to_dict(), new[name].to_dict(), given)
        found += [line.replace(": ", f": {name}: ", 1) for line in lines]
    return found


def compare_cells(old: dict, new: dict, given: argparse.Namespace) -> list[str]:
    """Of a column, by row: one line for the numbers that differ, one for the texts."""
    changes, texts = [], []
    for row in old.keys() & new.keys():
        line = f"{old[row]} -> {new[row]} (row {row})"
        if NUMBER.sub("#", old[row]) != NUMBER.sub("#", new[row]):
            texts.append(line)
            continue
        before, after = ([float(x) for x in NUMBER.findall(cells[row])] for cells in (old, new))
        by = [(abs(b - a), abs(a)) for a, b in zip(before, after, strict=True)]
        if any(change > given.atol + given.rtol * size for change, size in by):
            relative = max(change / size if size else float(change > 0) for change, size in by)
            changes.append((relative, max(by)[0], line))
    found = [f"texts: {len(texts)}, as {min(texts)}"] if texts else []
    if changes:
        absolute, (relative, _, line) = max(change[1] for change in changes), max(changes)
        found.append(f"numbers: {len(changes)}, by {absolute:.3g}, {relative:.2%}: {line}")
    return found


if __name__ == "__main__":
    main()
