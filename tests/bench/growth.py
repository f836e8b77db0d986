#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Ingests a simulated log and measures how its map and the program grow with the log.

    tests/bench/growth.py [--bin build/release/bin] [--minutes 60] [--world apartment] [--seed 3]
        [--folder growth-data] [--csv growth.csv] [--png growth.png] [--play 60]

Simulates the log if FOLDER/sim is not there, ingests it into FOLDER/store, and samples every two
seconds: the log time that the map has reached (its last pose), the bytes of its database, and the
resident memory of dsg-ingest. With --play N the log is of --minutes / N minutes, and is read N
times without a break, every second time backwards: what is seen is as much as in the short log, how
often it is seen as in a long one. Writes the samples as CSV, with --png also as a picture (needs
python3-matplotlib). Exits with 1 if the map takes more than --target-mb-s megabytes a second of
log, and with the status of dsg-ingest if that fails.
"""

import argparse
import csv
import json
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import time

SAMPLE_S = 2.0


def play(log, out, count):
    """Writes a log that shows `log` `count` times, every second time backwards."""
    shutil.rmtree(out, ignore_errors=True)
    for source in sorted((log / "mav0").iterdir()):
        if source.name == "imu0" or source.name.endswith("_clean"):
            continue
        target = out / "mav0" / source.name
        target.mkdir(parents=True)
        if (source / "data").is_dir():
            (target / "data").symlink_to((source / "data").resolve())
        if (source / "sensor.yaml").exists():
            shutil.copy(source / "sensor.yaml", target)
        if (source / "data.csv").exists():
            head, *rows = (source / "data.csv").read_text().splitlines()
            played = repeat([(int(row.split(",")[0]), row.split(",", 1)[1]) for row in rows], count,
                            spans(log))
            lines = [head] + [f"{stamp},{rest}" for stamp, rest in played]
            (target / "data.csv").write_text("\n".join(lines) + "\n")
        else:
            rows = [json.loads(line) for line in (source / "data.jsonl").read_text().splitlines()]
            played = repeat([(row["time_ns"], row) for row in rows], count, spans(log))
            lines = [json.dumps({**row, "time_ns": stamp, "id": number})
                     for number, (stamp, row) in enumerate(played)]
            (target / "data.jsonl").write_text("\n".join(lines) + "\n")
    shutil.copy(log / "labels.csv", out)
    header = json.loads((log / "log.json").read_text())
    header.pop("counts", None)
    (out / "log.json").write_text(json.dumps(header))


def spans(log):
    """First and last stamp of the poses."""
    rows = (log / "mav0/state_groundtruth_estimate0/data.csv").read_text().splitlines()[1:]
    return int(rows[0].split(",")[0]), int(rows[-1].split(",")[0])


def repeat(rows, count, span):
    """(stamp, rest) `count` times one after another, turned around every second time."""
    first, last = span
    step = 10_000_000
    rows = [row for row in rows if first <= row[0] <= last]
    played = []
    for turn in range(count):
        begin = first + turn * (last - first + step)
        if turn % 2 == 0:
            played += [(begin + stamp - first, rest) for stamp, rest in rows]
        else:
            played += [(begin + last - stamp, rest) for stamp, rest in reversed(rows)]
    return played


def folder_bytes(folder):
    return sum(file.stat().st_size for file in folder.glob("**/*") if file.is_file())


def state(folder):
    """Log time between the first and the last pose, seconds, and MB of the database; 0 if none."""
    try:
        map_file = sqlite3.connect(f"file:{folder / 'graph.db'}?mode=ro", uri=True, timeout=1.0)
    except sqlite3.OperationalError:
        return 0.0, 0.0
    try:
        first, last = map_file.execute("SELECT min(t0), max(t1) FROM trajectory_segment").fetchone()
        pages = map_file.execute("PRAGMA page_count").fetchone()[0]
        page_bytes = map_file.execute("PRAGMA page_size").fetchone()[0]
        return 0.0 if first is None else (last - first) / 1e9, pages * page_bytes / 1e6
    except sqlite3.OperationalError:
        return 0.0, 0.0
    finally:
        map_file.close()


def resident_bytes(pid):
    try:
        for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) * 1024
    except (FileNotFoundError, ProcessLookupError):
        pass
    return 0


def sample(process, folder):
    """Rows of wall seconds, log seconds, map MB and resident MB, until the program ends."""
    rows = []
    start = time.monotonic()
    while process.poll() is None:
        rows.append((time.monotonic() - start, *state(folder), resident_bytes(process.pid) / 1e6))
        if len(rows) % 30 == 0:
            print("%7.0f s: log %7.0f s, map %8.2f MB, memory %7.0f MB" % rows[-1], flush=True)
        time.sleep(SAMPLE_S)
    rows.append((time.monotonic() - start, *state(folder), rows[-1][3]))
    return rows


def draw(pyplot, rows, png):
    minutes = [row[1] / 60.0 for row in rows]
    figure, disk = pyplot.subplots(figsize=(9, 5))
    disk.plot(minutes, [row[2] for row in rows], color="tab:blue")
    disk.set_xlabel("log, minutes")
    disk.set_ylabel("map on disk, MB", color="tab:blue")
    disk.set_ylim(bottom=0)
    memory = disk.twinx()
    memory.plot(minutes, [row[3] for row in rows], color="tab:red")
    memory.set_ylabel("resident memory, MB", color="tab:red")
    memory.set_ylim(bottom=0)
    figure.tight_layout()
    figure.savefig(png, dpi=120)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release/bin"))
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--world", default="apartment")
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("growth-data"))
    parser.add_argument("--csv", type=pathlib.Path, default=pathlib.Path("growth.csv"))
    parser.add_argument("--png", type=pathlib.Path)
    parser.add_argument("--play", type=int, default=1)
    parser.add_argument("--target-mb-s", type=float, default=0.1)
    options = parser.parse_args()
    if options.png is not None:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot
    simulation = options.folder / "sim"
    options.folder.mkdir(parents=True, exist_ok=True)
    if not simulation.exists():
        subprocess.run([options.bin / "dsg-simulate", "sensors", "--world", options.world, "--seed",
                        str(options.seed), "--seconds",
                        str(60.0 * options.minutes / options.play), "--out", simulation],
                       check=True)
    log = simulation / "log"
    if options.play > 1:
        play(log, options.folder / "played", options.play)
        log = options.folder / "played"
    print(f"log of {folder_bytes(log) / 1e9:.2f} GB", flush=True)
    store = options.folder / "store"
    shutil.rmtree(store, ignore_errors=True)
    process = subprocess.Popen([options.bin / "dsg-ingest", "--store", store, "--map", "growth",
                                "--poses", "gt", log])
    rows = sample(process, store / "growth")
    if process.returncode != 0:
        return process.returncode
    with options.csv.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("wall_s", "log_s", "map_mb", "resident_mb"))
        writer.writerows([f"{value:.3f}" for value in row] for row in rows)
    if options.png is not None:
        draw(pyplot, rows, options.png)
    wall_s, log_s, map_mb, _ = rows[-1]
    rate = map_mb / log_s
    print(f"map {map_mb:.2f} MB after {log_s:.0f} s of log, {rate:.3f} MB a second; "
          f"most memory {max(row[3] for row in rows):.0f} MB; {wall_s:.0f} s")
    return 0 if rate <= options.target_mb_s else 1


if __name__ == "__main__":
    sys.exit(main())
