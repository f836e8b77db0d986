#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""dsg-ingest's options in a YAML file, runs that write nothing, and summaries for programs."""

import hashlib
import json
import os
import re
import subprocess
import unittest

import support

SHIPPED = os.path.join(support.ROOT, "ingest", "configurations")

# Of the groups that some seconds of depth, labels and people concern, a number that is far from its
# default; each stage must have read it if the map is another.
NUMBERS = {
    "fusion, instances and mesh": ("volume-truncation", "2"),
    "depth frames": ("depth-mask-growth", "30"),
    "walls, floors and ceilings": ("structure-wall-area", "20"),
    "places": ("place-block", "2"),
    "rooms": ("room-ceiling-area", "40"),
    "objects and their relations": ("object-cells", "60"),
    "storeys and updates of layers": ("layers-floor-area", "1000"),
    "detections of people": ("person-ray", "1"),
    "tracks of people": ("track-memory", "0.1"),
    "agents and their stays": ("agent-robot-half-size", "1"),
}


class Configuration(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.small = cls.simulate("small", people=3, seconds=60)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as f:
            f.write(text)
        return name

    def printed(self, *options):
        """The options in force, by name; without those that have no value."""
        text = self.ok("dsg-ingest", *options, "--print-config")
        lines = [line for line in text.splitlines() if line and not line.startswith("#")]
        return dict(line.split(": ", 1) for line in lines), text

    def test_what_is_printed_is_a_file_that_prints_the_same(self):
        values, text = self.printed("--voxel", "0.08", "--no-layers", "--map", "m", "--up",
                                    "0,0,1", "--room-bay-sparse", "0.65", "--place-block", "2")
        self.assertEqual("0.65", values["room-bay-sparse"])
        self.write("again.yaml", text)
        self.assertEqual(text, self.printed("--config", "again.yaml")[1])

    def test_the_file_goes_before_defaults_and_the_command_line_before_the_file(self):
        self.write("a.yaml", "# mine\nvoxel: 0.08\nrange: 4\nno-layers: true\nrooms: ceiling\n")
        values, _ = self.printed("--config", "a.yaml", "--range", "3")
        self.assertEqual("0.08", values["voxel"])
        self.assertEqual("3", values["range"])
        self.assertEqual("true", values["no-layers"])
        self.assertEqual("ceiling", values["rooms"])
        self.assertEqual("ground", values["places"])

    def test_the_file_does_what_the_options_do(self):
        self.write("b.yaml", "store: by-file\nmap: office\ncommit-poses: 100\nagent-prefix: x-\n")
        self.ok("dsg-ingest", "--config", "b.yaml", self.small)
        self.ok("dsg-ingest", "--store", "by-options", "--map", "office", "--commit-poses", "100",
                "--agent-prefix", "x-", self.small)
        logs = [self.ask("log", "--store", store)["revisions"] for store in
                ("by-file", "by-options")]
        self.assertEqual([r["session_id"] for r in logs[0]], [r["session_id"] for r in logs[1]])

    def test_wrong_files_are_refused_with_their_line(self):
        for text, line, words in (
                ("voxel: 0.05\nvoxl: 0.08\n", 2, "voxl"),
                ("voxel: 0.05\n\nvoxel: 0.08\n", 3, "again"),
                ("no-layers: 3\n", 1, "true or false"),
                ("voxel:\n", 1, "no value"),
                ("voxel: {a: 1}\n", 1, "scalar"),
                ("voxel: 0.05\n---\nrange: 3\n", 2, "second document"),
                ("- voxel\n", 1, "map of options"),
                ("voxel: [\n", 2, "YAML"),
                ("config: other.yaml\n", 1, "config"),
                ("LOG: small\n", 1, "LOG"),
                ("[" * 5000, 1, "deep")):
            name = self.write("wrong.yaml", text)
            self.refused(2, [f"wrong.yaml:{line}: ", words], "dsg-ingest", "--config", name,
                         "--store", "none", "--map", "m", self.small)
        self.refused(2, ["nowhere.yaml"], "dsg-ingest", "--config", "nowhere.yaml", "--store",
                     "none", "--map", "m", self.small)
        for name in (".", "nowhere.yaml"):
            self.refused(2, [f"{name} was not readable"], "dsg-ingest", "--config", name,
                         "--print-config")
        self.refused(2, ["rooms"], "dsg-ingest", "--config",
                     self.write("value.yaml", "rooms: round\n"), "--store", "none", "--map", "m",
                     self.small)
        for option in ("mesh-seconds", "odometry-m-per-m", "detector-score"):
            for number in ("nan", "inf"):
                self.refused(2, ["dsg-ingest: --" + option, number], "dsg-ingest",
                             "--" + option, number, "--store", "none", "--map", "m", self.small)
        for period in ("0", "-1"):
            self.refused(2, ["--frame-period " + period], "dsg-ingest", "--frame-period", period,
                         "--store", "none", "--map", "m", self.small)
        self.assertFalse(os.path.exists(self.path("none")))

    def test_options_of_stages_have_ranges_and_groups(self):
        for name, value, bounds in (("room-bay-sparse", "1.5", "0 to 1"),
                                    ("place-block", "0.1", "0.2 to 20")):
            self.refused(2, [name, value, bounds], "dsg-ingest", "--" + name, value, "--store",
                         "none", "--map", "m", self.small)
            self.refused(2, [name, value, bounds], "dsg-ingest", "--config",
                         self.write("range.yaml", f"{name}: {value}\n"), "--store", "none",
                         "--map", "m", self.small)
        self.assertFalse(os.path.exists(self.path("none")))
        _, text = self.printed()
        groups = [line[7:] for line in text.splitlines() if line.startswith("# ---- Tuning: ")]
        brief, whole = (self.ok("dsg-ingest", option) for option in ("--help", "--help-all"))
        with open(os.path.join(support.ROOT, "docs", "configuration.md"), encoding="utf-8") as f:
            docs = f.read()
        self.assertEqual(docs.count("| Tuning: "), len(groups))
        for group in groups:
            self.assertIn(f"| {group} |", docs)
            self.assertIn(group, brief)
        for name in ("place-block", "room-bay-sparse", "structure-gap"):
            self.assertIn("\n" + name + ": ", text)
            self.assertIn("--" + name, whole)
            self.assertNotIn("--" + name, brief)

    def content(self, store):
        """All that a map says, without the session that said it and its count of revisions."""
        out = self.path(store, "exported")
        self.ok("dsg", "export", "--store", store, "--spark", out + ".json", "--ply", out + ".ply",
                "--pose-step", "0")
        with open(out + ".json", encoding="utf-8") as f:
            graph = f.read()
        for revision in self.ask("log", "--store", store)["revisions"]:
            graph = graph.replace(revision["session_id"], "")
        with open(out + ".ply", "rb") as f:
            mesh = re.sub(rb"at revision [0-9]+", b"", f.read())
        graph = re.sub(r'"revision":[0-9]+', "", graph)
        return hashlib.sha256(graph.encode() + mesh).hexdigest()

    def test_a_number_of_each_stage_makes_another_map(self):
        self.ok("dsg-simulate", "sensors", "--world", "apartment", "--seed", "7", "--seconds", "5",
                "--rate", "10", "--keyframe-every", "2", "--humans", "3", "--out", "sim")
        def ingest(store, *options):
            self.ok("dsg-ingest", "--quiet", "--store", store, "--map", "m", *options,
                    os.path.join("sim", "log"))
            return self.content(store)
        usual = ingest("usual")
        _, text = self.printed()
        self.assertEqual(usual, ingest("again", "--config", self.write("all.yaml", text)))
        for i, (group, (name, value)) in enumerate(NUMBERS.items()):
            self.assertIn("# ---- Tuning: " + group + "\n", text)
            self.assertIn("\n" + name + ": ", text)
            with self.subTest(name):
                self.assertNotEqual(usual, ingest(f"store{i}", "--" + name, value))

    def test_what_only_a_network_reads_is_refused_without_one(self):
        for options, words in ((["--segmenter-size", "256"], ["segmenter-size", "--segmenter"]),
                               (["--detector-score", "0.9"], ["detector-score", "--detector"]),
                               (["--person-look-period", "3"], ["look-period", "--detector"])):
            self.refused(2, words, "dsg-ingest", "--store", "none", "--map", "m", *options,
                         self.small)
        self.refused(2, ["--quota"], "dsg-ingest", "--server", "unix:none.sock", "--map", "m",
                     "--quota", "1GB", self.small)
        self.refused(2, ["--retry-for", "--server"], "dsg-ingest", "--store", "none", "--map", "m",
                     "--retry-for", "5m", self.small)
        self.assertFalse(os.path.exists(self.path("none")))

    def test_an_empty_value_is_no_zero(self):
        config = self.write("empty.yaml", 'voxel: ""\n')
        for options, word in ((["--floor-z", ""], "--floor-z"), (["--loops", ""], "--loops"),
                              (["--config", config], "--voxel")):
            self.refused(2, [word + " has an empty value"], "dsg-ingest", "--store", "none",
                         "--map", "m", *options, self.small)
        self.assertFalse(os.path.exists(self.path("none")))

    def test_a_folder_that_takes_no_file_is_known_before_the_log(self):
        self.refused(3, ["/proc", "--spill-folder"], "dsg-ingest", "--store", "none", "--map", "m",
                     "--spill-folder", "/proc", self.small)
        self.assertFalse(os.path.exists(self.path("none")))

    def test_output_that_does_not_arrive_is_no_success(self):
        with open("/dev/full", "w", encoding="utf-8") as full:
            for more in (["--print-config"], ["--json"], []):
                done = subprocess.run(
                    ["dsg-ingest", "--store", "full", "--map", "m", *more, self.small],
                    cwd=self.folder, env=support.environment(), stdout=full,
                    stderr=subprocess.PIPE, text=True, check=False)
                self.assertEqual(3, done.returncode, done.stderr)
                self.assertIn("could not be written out in full", done.stderr)

    def test_shipped_files_are_in_force(self):
        names = sorted(os.listdir(SHIPPED))
        self.assertEqual(["euroc.yaml", "handheld_rgbd.yaml", "office_robot.yaml",
                          "people_tracks.yaml"], names)
        defaults, _ = self.printed()
        for name in names:
            values, _ = self.printed("--config", os.path.join(SHIPPED, name))
            self.assertNotEqual(defaults, values, name)

    def test_a_dry_run_says_what_the_run_would_and_writes_nothing(self):
        dry = json.loads(self.ok("dsg-ingest", "--dry-run", "--json", "--store", "dry", "--map",
                                 "office", self.small))
        self.assertFalse(os.path.exists(self.path("dry")))
        real = json.loads(self.ok("dsg-ingest", "--json", "--store", "dry", "--map", "office",
                                  self.small))
        self.assertTrue(dry.pop("dry_run"))
        self.assertFalse(real.pop("dry_run"))
        for summary in (dry, real):
            self.assertGreaterEqual(summary.pop("seconds"), 0)
        self.assertEqual(real, dry)
        self.assertGreater(real["poses"], 0)
        head = self.ask("stats", "--store", "dry")["head_revision"]
        # Of a map that has the log, nothing; of one that has not, what is new.
        again = json.loads(self.ok("dsg-ingest", "--dry-run", "--json", "--store", "dry", "--map",
                                   "office", self.small))
        self.assertEqual(0, again["revisions"])
        other = json.loads(self.ok("dsg-ingest", "--dry-run", "--json", "--agent-prefix", "b",
                                   "--store", "dry", "--map", "office", self.small))
        self.assertGreater(other["revisions"], 0)
        self.assertEqual(head, self.ask("stats", "--store", "dry")["head_revision"])
        self.refused(2, ["--server"], "dsg-ingest", "--dry-run", "--server", "unix:none.sock",
                     "--map", "office", self.small)


if __name__ == "__main__":
    unittest.main()
