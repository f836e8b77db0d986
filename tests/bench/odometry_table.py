#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Odometry in crowds, as a table like that of RSS 2020: absolute trajectory errors by people,
method and masks.

    tests/bench/odometry_table.py [--bin build/release/bin] [--folder odometry-data]
        [--world apartment] [--seconds 120] [--people 0 12 24 60] [--seeds 1 2 3 4 5]
        [--methods 5pt 2pt dvio] [--masks off on] [--drop] [--json FILE]
        [--log FOLDER --truth FOLDER]

Simulates each log that is not in FOLDER yet, ingests it with `--poses vio --no-layers`, and scores
the causal track with dsg-eval (alignment by heading and position). Prints the median over the
seeds, smallest and largest; metres of root mean square, per cent of the way over 10 m, squared
errors of position (3 is right) and heading (1 is right) in units of their covariance, the share of
the log that has poses, and the time of dsg-ingest beside that of the log. With --log a recorded log
is scored instead. Exits with 1 if a run fails.

A whole table takes hours, and 10 MB a second of log: --drop deletes each log that this run
simulated once it is scored. Each score is kept in FOLDER/scores.json under the digest of
dsg-ingest, so that a run which was stopped goes on where it was.
"""

import argparse
import hashlib
import json
import pathlib
import shutil
import statistics
import subprocess
import sys
import time


def run(command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit {done.returncode}\n{done.stderr[-2000:]}")
    return done


def simulate(arguments, people, seed):
    """The folder of a simulated log, and whether it was made now."""
    folder = arguments.folder / f"{arguments.world}-{arguments.seconds:g}s-{people}p-{seed}"
    if (folder / "log").exists():
        return folder, False
    print(f"simulating {folder}", file=sys.stderr, flush=True)
    # A log that was not finished is no log; the simulator goes on with it.
    begun = folder.with_name(folder.name + ".begun")
    run([arguments.bin / "dsg-simulate", "sensors", "--out", begun, "--world", arguments.world,
         "--people", people, "--seed", seed, "--seconds", f"{arguments.seconds:g}",
         *arguments.simulate])
    begun.rename(folder)
    return folder, True


def score(arguments, log, truth, method, masks):
    store = arguments.folder / "store"
    shutil.rmtree(store, ignore_errors=True)
    begin = time.monotonic()
    run([arguments.bin / "dsg-ingest", "--store", store, "--map", "m", "--poses", "vio",
         "--no-layers", "--odometry", method, "--odometry-masks", masks, "--quiet",
         *arguments.ingest, log])
    elapsed = time.monotonic() - begin
    report = json.loads(run([arguments.bin / "dsg-eval", "--store", store, "--map", "m", "--truth",
                             truth, "--trajectory", "--align", "yaw", "--json"]).stdout)
    return report, elapsed


def figures(report, elapsed):
    track = report["tracks"]["causal"]
    rpe = {row["length_m"]: row for row in track.get("rpe", [])}
    nees = track.get("nees") or {}
    return {"ate_m": track["ate"]["rmse_m"], "way_m": track["path_m"],
            "rpe10_percent": rpe.get(10, {}).get("translation_percent"),
            "nees_position": nees.get("position"), "nees_yaw": nees.get("yaw"),
            "coverage": track["coverage"], "seconds": elapsed}


def text(values, digits):
    known = [value for value in values if value is not None]
    if not known:
        return "-"
    if len(known) == 1:
        return f"{known[0]:.{digits}f}"
    middle = statistics.median(known)
    return f"{middle:.{digits}f} ({min(known):.{digits}f}-{max(known):.{digits}f})"


class Scores:
    """What was scored, in a file that each new score is added to."""

    def __init__(self, arguments):
        self.path = arguments.folder / "scores.json"
        self.of_build = hashlib.sha256((arguments.bin / "dsg-ingest").read_bytes()).hexdigest()[:16]
        self.known = json.loads(self.path.read_text()) if self.path.exists() else {}

    def key(self, *parts):
        return " ".join(str(part) for part in (self.of_build, *parts))

    def add(self, key, row):
        self.known[key] = row
        begun = self.path.with_suffix(".begun")
        begun.write_text(json.dumps(self.known, indent=1) + "\n")
        begun.rename(self.path)


def score_crowd(arguments, scores, people, seed):
    """A row for each method, with masks and without."""
    wanted = {scores.key(arguments.world, f"{arguments.seconds:g}s", f"{people}p", seed, masks,
                         method, *arguments.simulate, *arguments.ingest): (masks, method)
              for masks in arguments.masks for method in arguments.methods}
    missing = {key: kind for key, kind in wanted.items() if key not in scores.known}
    if missing:
        folder, is_new = simulate(arguments, people, seed)
        for key, (masks, method) in missing.items():
            print(f"scoring {folder} {method} masks {masks}", file=sys.stderr, flush=True)
            one = figures(*score(arguments, folder / "log", folder / "truth", method, masks))
            scores.add(key, {"people": people, "masks": masks, "method": method, "seed": seed,
                             **one})
        if is_new and arguments.drop:
            shutil.rmtree(folder)
    return [scores.known[key] for key in wanted]


def table_line(people, masks, method, rows):
    def column(name, digits):
        return text([row[name] for row in rows], digits)
    return " | ".join([str(people), masks, method, column("ate_m", 3), column("rpe10_percent", 2),
                       column("nees_position", 2), column("nees_yaw", 2), column("coverage", 3),
                       column("way_m", 0), column("seconds", 0)])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release/bin"))
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("odometry-data"))
    parser.add_argument("--world", default="apartment")
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--people", type=int, nargs="+", default=[0, 12, 24, 60])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--methods", nargs="+", default=["5pt", "2pt", "dvio"])
    parser.add_argument("--masks", nargs="+", default=["off", "on"])
    parser.add_argument("--drop", action="store_true", help="delete simulated logs once scored")
    parser.add_argument("--simulate", nargs="*", default=[], help="more for dsg-simulate")
    parser.add_argument("--ingest", nargs="*", default=[], help="more for dsg-ingest")
    parser.add_argument("--log", type=pathlib.Path)
    parser.add_argument("--truth", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    if arguments.log:
        arguments.masks = ["off"]
        rows = [{"people": "-", "masks": "off", "method": method, "seed": 0,
                 **figures(*score(arguments, arguments.log, arguments.truth, method, "off"))}
                for method in arguments.methods]
    else:
        scores = Scores(arguments)
        # A whole row of crowds for each seed: a table that was stopped has fewer seeds.
        rows = [row for seed in arguments.seeds for people in arguments.people
                for row in score_crowd(arguments, scores, people, seed)]
    print("people | masks | method | ATE m | RPE 10 m % | NEES position | NEES heading | coverage "
          "| way m | s")
    for people in ["-"] if arguments.log else arguments.people:
        for masks in arguments.masks:
            for method in arguments.methods:
                print(table_line(people, masks, method, [
                    row for row in rows
                    if (row["people"], row["masks"], row["method"]) == (people, masks, method)]))
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
