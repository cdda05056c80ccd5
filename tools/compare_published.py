#!/usr/bin/env python3
"""Compares the weighted errors of `clothfit study recordings` with published ones.

    compare_published.py STUDY/study.csv RECORDINGS

reads the study, and of every recording in it RECORDINGS/NAME/truth_reference.json, which the
program itself never opens: its `published_weighted_rms_mm` and `rigid_weighted_rms_mm`. Prints one
line per series and model, and on how many series a model is better than the lower of the two.
"""

import csv
import json
import pathlib
import sys


def main() -> int:
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    recordings = pathlib.Path(sys.argv[2])
    better, judged = {}, {}
    print(f"{'series':36} {'model':36} {'ours':>6} {'publ.':>6} {'rigid':>6}   (weighted rms, mm)")
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        reference = recordings / row["recording"] / "truth_reference.json"
        if not reference.exists() or not row["weighted_rms"]:
            continue
        truth = json.loads(reference.read_text())
        if "published_weighted_rms_mm" not in truth:
            continue
        published, rigid = truth["published_weighted_rms_mm"], truth["rigid_weighted_rms_mm"]
        ours = 1000 * float(row["weighted_rms"])
        wins = ours < min(published, rigid)
        model = row["model"]
        judged[model] = judged.get(model, 0) + 1
        better[model] = better.get(model, 0) + wins
        print(f"{row['recording']:36} {model:36} {ours:6.1f} {published:6.1f} {rigid:6.1f}"
              f"   {'better' if wins else ''}")
    for model, count in judged.items():
        print(f"{model}: better than the lower of both on {better[model]} of {count}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
