#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Odometry in crowds, as a table like that of RSS 2020: absolute trajectory errors by people,
method and masks.

    tests/bench/odometry_table.py [--bin build/release/bin] [--folder odometry-data]
        [--world apartment] [--seconds 120] [--people 0 12 24 60] [--seeds 1 2 3 4 5]
        [--methods 5pt 2pt dvio] [--masks off on] [--json FILE] [--log FOLDER --truth FOLDER]

Simulates each log that is not in FOLDER yet, ingests it with `--poses vio --no-layers`, and scores
the causal track with dsg-eval (alignment by heading and position). Prints the median over the
seeds, smallest and largest; metres of root mean square, per cent of the way over 10 m, squared
errors of position (3 is right) and heading (1 is right) in units of their covariance, the share of
the log that has poses, and the time of dsg-ingest beside that of the log. With --log a recorded log
is scored instead. Exits with 1 if a run fails.
"""

import argparse
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
    folder = arguments.folder / f"{arguments.world}-{arguments.seconds:g}s-{people}p-{seed}"
    if not (folder / "log").exists():
        print(f"simulating {folder}", file=sys.stderr, flush=True)
        run([arguments.bin / "dsg-simulate", "sensors", "--out", folder, "--world",
             arguments.world, "--people", people, "--seed", seed, "--seconds",
             f"{arguments.seconds:g}", *arguments.simulate])
    return folder / "log", folder / "truth"


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
    parser.add_argument("--simulate", nargs="*", default=[], help="more for dsg-simulate")
    parser.add_argument("--ingest", nargs="*", default=[], help="more for dsg-ingest")
    parser.add_argument("--log", type=pathlib.Path)
    parser.add_argument("--truth", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    print("people | masks | method | ATE m | RPE 10 m % | NEES position | NEES heading | coverage "
          "| way m | s")
    for people in [None] if arguments.log else arguments.people:
        for masks in ["off"] if arguments.log else arguments.masks:
            for method in arguments.methods:
                runs = []
                for seed in [0] if arguments.log else arguments.seeds:
                    log, truth = ((arguments.log, arguments.truth) if arguments.log
                                  else simulate(arguments, people, seed))
                    one = figures(*score(arguments, log, truth, method, masks))
                    runs.append(one)
                    rows.append({"people": people, "masks": masks, "method": method, "seed": seed,
                                 **one})
                column = {key: [one[key] for one in runs] for key in runs[0]}
                print(f"{people if people is not None else '-'} | {masks} | {method} | "
                      f"{text(column['ate_m'], 3)} | {text(column['rpe10_percent'], 2)} | "
                      f"{text(column['nees_position'], 2)} | {text(column['nees_yaw'], 2)} | "
                      f"{text(column['coverage'], 3)} | {text(column['way_m'], 0)} | "
                      f"{text(column['seconds'], 0)}", flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
