# SPDX-License-Identifier: Apache-2.0
"""Runs behind tables of figures: logs simulated once, maps made of them and scored, scores kept.

A table names variants, each a way to make a map of a log and to score it. `Runner.score_all` makes
the report of dsg-eval for each; what was scored before with the same programs and arguments comes
from the file of scores, so that a run which was stopped goes on where it was. Variants whose maps
are made alike share one.
"""

import dataclasses
import datetime
import hashlib
import json
import pathlib
import shutil
import subprocess
import sys
import time

# Stands for the truth folder of a log in the arguments of a variant.
TRUTH = "{truth}"


class RunFailed(Exception):
    """A program ended with an error; its message is on standard error already."""


@dataclasses.dataclass(frozen=True)
class Variant:
    """A way to make a map of a log, and to score it."""

    name: str
    ingest: tuple
    evaluate: tuple = ()
    # Whether a mesh is scored: then the number of samples on it is that of the runner.
    has_mesh: bool = False
    # Whether it differs from another one only where there are people.
    is_of_people: bool = False

    def says_something_of(self, log):
        return log.people != 0 or not self.is_of_people


@dataclasses.dataclass(frozen=True)
class Log:
    """A log to be simulated, or one that was recorded: then with its folders, without a seed, and
    with a name in place of the number of people."""

    name: str
    people: int | str
    seed: int | None
    simulate: tuple = ()
    log: pathlib.Path | None = None
    truth: pathlib.Path | None = None


def simulated(world, seconds, people, seed, more=()):
    """The log of dsg-simulate with these arguments."""
    extra = "".join("-" + part.strip("-") for part in more)
    return Log(f"{world}-{seconds:g}s-{people}p-{seed}{extra}", people, seed,
               ("--world", world, "--people", str(people), "--seed", str(seed),
                "--seconds", f"{seconds:g}", *more))


def wanted(logs, variants):
    """How many scores all logs and variants make."""
    return sum(one.says_something_of(log) for log in logs for one in variants)


def say(text):
    print(text, file=sys.stderr, flush=True)


def run(command):
    """Runs a program to its end, and gives what it printed."""
    command = [str(part) for part in command]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        say(f"{' '.join(command)}: exit {done.returncode}\n{done.stderr[-2000:]}")
        raise RunFailed(f"{pathlib.Path(command[0]).name} failed with exit {done.returncode}")
    return done.stdout


class Scores:
    """What was scored, in a file that each new score is added to."""

    def __init__(self, path):
        self.path = path
        self.known = json.loads(path.read_text()) if path.exists() else {}

    def add(self, key, row):
        self.known[key] = row
        begun = self.path.with_suffix(".begun")
        begun.write_text(json.dumps(self.known, indent=1) + "\n")
        begun.rename(self.path)


def digest_of(programs):
    digest = hashlib.sha256()
    for program in programs:
        digest.update(program.read_bytes())
    return digest.hexdigest()[:16]


class Runner:
    """Scores variants of logs with the programs of a folder, one program at a time."""

    def __init__(self, programs, folder, ingest=(), drop=False, mesh_samples=None):
        self.programs = programs
        self.folder = folder
        self.more = tuple(ingest)
        self.drop = drop
        self.samples = () if mesh_samples is None else ("--mesh-samples", str(mesh_samples))
        folder.mkdir(parents=True, exist_ok=True)
        self.scores = Scores(folder / "scores.json")
        # The log is made once and stays, whatever program comes after it.
        self.build = digest_of([programs / "dsg-ingest", programs / "dsg-eval"])
        self.failed = {}
        self.left = 0

    def evaluation(self, variant):
        return (*variant.evaluate, *(self.samples if variant.has_mesh else ()))

    def key(self, log, variant):
        # Recorded logs may have one name in different folders.
        name = log.name if log.log is None else str(log.log.resolve())
        return " ".join([self.build, name, *variant.ingest, *self.more, "|",
                         *self.evaluation(variant)])

    def known(self, log, variant):
        """The report, or None; and why there is none."""
        key = self.key(log, variant)
        if key in self.scores.known:
            return self.scores.known[key]["report"], None
        return None, self.failed.get(key, "not run yet")

    def missing(self, log, variants):
        return [one for one in variants
                if one.says_something_of(log) and self.key(log, one) not in self.scores.known]

    def score_all(self, logs, variants):
        """Scores what is missing, log by log; a run that fails leaves the others as they are."""
        self.left = sum(len(self.missing(log, variants)) for log in logs)
        say(f"{self.left} of {wanted(logs, variants)} scores to make")
        for log in logs:
            missing = self.missing(log, variants)
            if not missing:
                continue
            try:
                folders, is_new = self.obtain(log)
            except RunFailed as failure:
                self.failed.update({self.key(log, one): str(failure) for one in missing})
                self.left -= len(missing)
                continue
            for ingest in dict.fromkeys(one.ingest for one in missing):
                self.score(log, folders, [one for one in missing if one.ingest == ingest])
            if is_new and self.drop:
                shutil.rmtree(folders[0].parent)

    def obtain(self, log):
        """Folders of the log and of its truth, and whether they were simulated now."""
        if log.log is not None:
            return (log.log, log.truth), False
        folder = self.folder / log.name
        if (folder / "log").exists():
            return (folder / "log", folder / "truth"), False
        say(f"{log.name}: simulating")
        # A log that was not finished is no log; the simulator goes on with it.
        begun = folder.with_name(folder.name + ".begun")
        run([self.programs / "dsg-simulate", "sensors", "--out", begun, *log.simulate])
        begun.rename(folder)
        return (folder / "log", folder / "truth"), True

    def score(self, log, folders, variants):
        """Makes a map, all variants' ingest being the same, and keeps the report of each."""
        say(f"{log.name}: {variants[0].name} ({self.left} left)")
        self.left -= len(variants)
        store = self.folder / "store"
        shutil.rmtree(store, ignore_errors=True)
        truth = str(folders[1])
        begin = time.monotonic()
        try:
            run([self.programs / "dsg-ingest", "--store", store, "--map", "m", "--quiet",
                 *[part.replace(TRUTH, truth) for part in variants[0].ingest], *self.more,
                 folders[0]])
            ingest_s = time.monotonic() - begin
            for variant in variants:
                self.keep(log, variant, ingest_s, run(
                    [self.programs / "dsg-eval", "--store", store, "--map", "m", "--truth", truth,
                     "--json", *self.evaluation(variant)]))
        except RunFailed as failure:
            self.failed.update({self.key(log, one): str(failure)
                                for one in self.missing(log, variants)})
            return
        finally:
            shutil.rmtree(store, ignore_errors=True)
        say(f"{log.name}: {variants[0].name}: {time.monotonic() - begin:.0f} s")

    def keep(self, log, variant, ingest_s, output):
        report = json.loads(output)
        report["ingest_s"] = ingest_s
        if report.get("mesh"):
            report["mesh"].pop("class_iou", None)
        self.scores.add(self.key(log, variant), {
            "log": log.name, "variant": variant.name, "people": log.people, "seed": log.seed,
            "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
            "report": report})
