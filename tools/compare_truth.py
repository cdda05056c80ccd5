#!/usr/bin/env python3
"""Compares a simulation with the true positions of a recording, which the program never opens.

    compare_truth.py SIMULATION RECORDING FROM_FRAME

SIMULATION is a folder that `clothfit simulate --fit FIT` wrote, RECORDING one with markers.csv and
truth_tracks3d.csv.gz. Prints the rms distance of the markers that lie on vertices of the
simulation, before FROM_FRAME and from there on.
"""

import csv
import gzip
import math
import pathlib
import sys


def rows(path: pathlib.Path):
    opened = gzip.open(path, "rt") if path.suffix == ".gz" else open(path, newline="")
    with opened as file:
        yield from csv.DictReader(line for line in file if not line.startswith("#"))


def tracks(path: pathlib.Path, markers: pathlib.Path):
    """(frame, s, t) -> place; s and t in micrometres."""
    at = {r["marker"]: tuple(round(1e6 * float(r[a])) for a in "st") for r in rows(markers)}
    return {
        (int(r["frame"]), *at[r["marker"]]): [float(r[a]) for a in "xyz"] for r in rows(path)
    }


def main() -> int:
    if len(sys.argv) != 4:
        print(__doc__, file=sys.stderr)
        return 2
    simulation, recording = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    from_frame = int(sys.argv[3])
    simulated = tracks(simulation / "tracks3d.csv", simulation / "markers.csv")
    true = tracks(recording / "truth_tracks3d.csv.gz", recording / "markers.csv")
    if not simulated.keys() & true.keys():
        print("no marker of the recording lies on a vertex of the simulation", file=sys.stderr)
        return 1
    for title, judged in (("before", False), ("from there", True)):
        squares = [
            math.dist(simulated[key], place) ** 2
            for key, place in true.items()
            if key in simulated and (key[0] >= from_frame) == judged
        ]
        if squares:
            rms_mm = 1000 * math.sqrt(sum(squares) / len(squares))
            print(f"{title}: {rms_mm:.3f} mm rms distance at {len(squares)} places")
    return 0


if __name__ == "__main__":
    sys.exit(main())
