#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a terminal expects: completion, manuals, pipes that close, exports that other programs
read."""

import csv
import glob
import json
import os
import resource
import shlex
import shutil
import signal
import subprocess
import unittest

import support

PROGRAMS = ("dsg", "dsg-align", "dsg-eval", "dsg-ingest", "dsg-optimize", "dsg-overlay",
            "dsg-server", "dsg-simulate")


def built(program):
    return os.path.exists(os.path.join(support.BIN, program))


def sanitized():
    """Sanitizers keep what is freed, and start slowly."""
    with open(os.path.join(support.BIN, "dsg"), "rb") as file:
        return b"__asan_init" in file.read()


class Terminal(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ingest("store", cls.simulate("office", people=3, seconds=60))
        cls.ok("dsg", "tag", "built", "--store", "store", "--revision", "1")

    def shell(self, *command, typed=""):
        """What a shell prints, with dsg in its path and the store in its environment."""
        return subprocess.run(command, cwd=self.folder, input=typed, text=True,
                              capture_output=True, check=False, timeout=support.TIMEOUT_S,
                              env=dict(support.environment(), DSG_STORE="store"))

    def completed(self, *words):
        """What bash offers for the last word."""
        line = " ".join(shlex.quote(w) for w in words)
        script = (f"source <(dsg completion bash); COMP_WORDS=(dsg {line}); "
                  f"COMP_CWORD={len(words)}; _dsg_complete; printf '%s\\n' \"${{COMPREPLY[@]}}\"")
        done = self.shell("bash", "-c", script)
        self.assertEqual("", done.stderr)
        return done.stdout.split("\n")[:-1]

    def test_bash_completes_verbs_options_and_choices(self):
        self.assertEqual(["predict"], self.completed("pred"))
        self.assertEqual(["--horizon"], self.completed("predict", "--hor"))
        self.assertEqual(["csv"], self.completed("ls", "--format", "c"))
        self.assertIn("where", self.completed(""))

    def test_bash_completes_what_the_store_knows(self):
        if sanitized():
            self.skipTest("a sanitizer takes more than 200 ms")
        for words, expected in ((("ls", "--map", ""), "office"),
                                (("ls", "--revision", "b"), "built"),
                                (("where", "al"), "alice"),
                                (("where", "H"), "H0"),
                                (("show", "O1"), "O11"),
                                (("ls", "--layer", "ag"), "agents"),
                                (("ls", "--kind", "ro"), "room"),
                                (("edges", "--relation", "CONT"), "CONTAINS"),
                                (("who", "--room", "off"), "office\\ 1")):
            # A busy machine may need more than the 200 ms after which names are left out.
            for _ in range(20):
                offered = self.completed(*words)
                if expected in offered:
                    break
            self.assertIn(expected, offered)

    def test_every_program_says_what_a_misspelt_option_may_have_meant(self):
        for program in filter(built, PROGRAMS):
            self.refused(2, [f"{program}: not understood: --hlep; near in spelling: \"--help\"",
                             f"; see {program} --help"], program, "--hlep")
        self.refused(2, ["dsg-simulate: there is no verb \"track\"; near in spelling: \"tracks\""],
                     "dsg-simulate", "track")

    def test_completion_of_an_unreachable_server_gives_up(self):
        done = support.run("dsg", "completion", "words", "--", "where", "--server",
                           "unix:nobody.sock", "", cwd=self.folder)
        self.assertEqual((0, "", ""), (done.returncode, done.stdout, done.stderr))

    @unittest.skipUnless(shutil.which("zsh"), "there is no zsh")
    def test_zsh_takes_the_script(self):
        self.ok("sh", "-c", "dsg completion zsh > _dsg && zsh -n _dsg")
        # compadd needs a terminal; a function of that name shows what it would be given.
        script = ("autoload -U compinit; compinit -D -u; source <(dsg completion zsh); "
                  "compadd() { shift; print -l -- \"$@\" }; "
                  "words=(dsg predict --hor); CURRENT=3; _dsg_complete")
        done = self.shell("zsh", "-f", "-c", script)
        self.assertEqual("--horizon\n", done.stdout, done.stderr)

    @unittest.skipUnless(shutil.which("fish"), "there is no fish")
    def test_fish_takes_the_script(self):
        self.ok("sh", "-c", "dsg completion fish > dsg.fish && fish -n dsg.fish")
        done = self.shell("fish", "--no-config", "-c",
                          "source dsg.fish; complete -C 'dsg predict --hor'")
        self.assertEqual("--horizon\n", done.stdout, done.stderr)

    @unittest.skipUnless(shutil.which("mandoc"), "there is no mandoc")
    def test_manuals_are_clean(self):
        for program in filter(built, PROGRAMS):
            with self.subTest(program=program):
                page = self.ok(program, "--man")
                lint = self.shell("mandoc", "-T", "lint", typed=page)
                self.assertEqual((0, ""), (lint.returncode, lint.stdout + lint.stderr))
                shown = self.shell("mandoc", "-T", "ascii", typed=page).stdout
                self.assertIn(program, shown)

    def test_a_pipe_that_closes_ends_the_program_quietly(self):
        for verb in (["track", "alice", "--every", "1ms"], ["ls", "--format", "csv"]):
            done = self.shell("bash", "-c",
                              f"dsg {shlex.join(verb)} | head -n 1; echo ${{PIPESTATUS[0]}}")
            self.assertEqual("", done.stderr)
            code = int(done.stdout.split()[-1])
            # A list that fits into the pipe is written in full.
            self.assertIn(code, (0, 128 + signal.SIGPIPE), verb)

    def test_a_track_of_any_length_takes_bounded_memory(self):
        """Sixty seconds by the millisecond: 60,000 rows, in each format."""
        if sanitized():
            self.skipTest("a sanitizer keeps the memory that is freed")
        sizes = {}
        for every, options in (("1s", []), ("1ms", ["--format", "table"]),
                               ("1ms", ["--format", "csv"]), ("1ms", ["--format", "jsonl"]),
                               ("1ms", ["--json"])):
            command = ["dsg", "track", "robot", "--every", every, "--store", "store", *options]
            with open(self.path("rows"), "wb") as rows:
                process = subprocess.Popen(command, cwd=self.folder, stdout=rows,
                                           env=support.environment())
                _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            self.assertEqual(0, process.returncode, command)
            sizes[" ".join(options) or "few"] = usage.ru_maxrss * 1024
            with open(self.path("rows"), "rb") as rows:
                self.assertGreater(sum(1 for _ in rows), 50_000 if every == "1ms" else 50)
        # What 60 rows take; the rows of a table in memory were 33 MB more.
        few = sizes.pop("few")
        self.assertLess(max(sizes.values()), few + (16 << 20), sizes)

    def test_tum_files_are_read_by_the_other_programs(self):
        self.ok("dsg", "export", "--store", "store", "--tum", "tum", "--csv", "tables")
        names = {os.path.basename(p) for p in glob.glob(self.path("tum", "*.tum"))}
        self.assertIn("robot.tum", names)
        # The same poses in a map of their own.
        self.ok("dsg-ingest", "--store", "again", "--map", "again", "tum/robot.tum")
        agents = self.ask("ls", "--store", "again", "--layer", "agents")["nodes"]
        self.assertEqual(1, len(agents))
        again = self.ask("track", agents[0]["id"], "--store", "again")["poses"]
        first = self.ask("track", "robot", "--store", "store")["poses"]
        self.assertEqual([p["time_ns"] for p in first], [p["time_ns"] for p in again])
        for a, b in zip(first, again):
            for axis in "xyz":
                self.assertAlmostEqual(a["pose"]["position"][axis], b["pose"]["position"][axis],
                                       delta=2e-4)
        with open(self.path("tables", "tracks.csv"), encoding="utf-8", newline="") as file:
            rows = [r for r in csv.DictReader(file) if r["agent_name"] == "robot"]
        self.assertEqual([p["time_ns"] for p in first], [r["time_ns"] for r in rows])
        self.ok("dsg-ingest", "--store", "back", "--map", "back", "tables/tracks.csv")
        agents = {store: sorted((node["name"], node["kind"]) for node in
                                self.ask("ls", "--store", store, "--layer", "agents")["nodes"])
                  for store in ("store", "back")}
        self.assertEqual(agents["store"], agents["back"])

    def test_tum_files_are_scored(self):
        if not built("dsg-eval"):
            self.skipTest("dsg-eval is not built")
        self.ok("dsg", "export", "--store", "store", "--tum", "scored")
        report = self.ok("dsg-eval", "--truth", "scored/robot.tum", "--estimate",
                         "scored/robot.tum")
        self.assertIn("0.000", report)

    def test_an_export_that_fails_leaves_no_half_file(self):
        command = ["dsg", "export", "--store", "store", "--csv", "failed"]
        process = subprocess.Popen(command, cwd=self.folder, env=support.environment(),
                                   preexec_fn=lambda: resource.setrlimit(
                                       resource.RLIMIT_FSIZE, (100_000, 100_000)),
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        _, errors = process.communicate(timeout=support.TIMEOUT_S)
        self.assertNotEqual(0, process.returncode)
        self.assertIn("dsg: ", errors)
        for table in os.listdir(self.path("failed")):
            self.assertFalse(table.endswith(".part"), table)
            self.assertLess(os.path.getsize(self.path("failed", table)), 100_000)
        self.assertFalse(os.path.exists(self.path("failed", "tracks.csv")))

    def test_geojson_is_json(self):
        self.ok("dsg", "export", "--store", "store", "--geojson", "a.geojson", "--origin",
                "47.38,8.54,30")
        with open(self.path("a.geojson"), encoding="utf-8") as file:
            features = json.load(file)["features"]
        kinds = {f["properties"]["kind"] for f in features}
        self.assertEqual({"room", "object", "place", "human", "robot"}, kinds)
        for feature in features:
            self.assertAlmostEqual(47.38, positions(feature)[0][1], delta=0.002)

    def test_history_and_words_say_what_was_and_is_believed(self):
        self.ingest("renamed", self.simulate("small", people=1, seconds=5))
        store = ("--store", "renamed")
        room = self.ask("ls", "--kind", "room", *store)["nodes"][0]
        self.ok("dsg", "set", room["id"], "--name", "the den", *store)
        versions = self.ask("history", room["id"], *store)["versions"]
        self.assertEqual(["the den", room["name"]], [one["node"]["name"] for one in versions])
        self.assertEqual(versions[0]["from_revision"], versions[1]["to_revision"])
        table = self.ok("dsg", "history", room["id"], "--format", "csv", *store)
        rows = list(csv.DictReader(table.splitlines()))
        self.assertEqual(["the den", room["name"]], [row["name"] for row in rows])
        self.assertEqual("", rows[0]["to_revision"])
        self.refused(1, ["O999999"], "dsg", "history", "O999999", *store)
        rooms = len(self.ask("ls", "--kind", "room", *store)["nodes"])
        words = list(csv.DictReader(self.ok("dsg", "words", "--format", "csv",
                                            *store).splitlines()))
        self.assertIn({"type": "kind", "layer": "rooms", "word": "room", "count": str(rooms)},
                      words)
        # Nothing was believed before the first revision.
        self.assertEqual([], self.ask("words", "--revision", "0", *store)["words"])

    def test_json_lines_are_the_entries_of_the_reply(self):
        whole = self.ask("ls", "--store", "store", "--kind", "room")["nodes"]
        lines = self.ok("dsg", "ls", "--store", "store", "--kind", "room", "--format",
                        "jsonl").splitlines()
        self.assertEqual(whole, [json.loads(line) for line in lines])


def positions(feature):
    """The positions of a geometry, however deep."""
    found = feature["geometry"]["coordinates"]
    while isinstance(found[0], list) and isinstance(found[0][0], list):
        found = found[0]
    return found if isinstance(found[0], list) else [found]


if __name__ == "__main__":
    unittest.main()
