#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tables of the paper (`./dev tables`): figures, marks and files from given scores, and the
smallest run of the real programs."""

import json
import os
import pathlib
import sys
import tempfile
import types
import unittest

import support

sys.path.insert(0, os.path.join(support.ROOT, "tests", "bench"))

import paper_tables  # noqa: E402
import table_report  # noqa: E402
import table_runs  # noqa: E402
from table_report import Column, Row, Table  # noqa: E402

TABLES = os.path.join(support.ROOT, "tests", "bench", "paper_tables.py")
VARIANT = table_runs.Variant("masked", ("--masking", "carve"))
OTHER = table_runs.Variant("unmasked", ("--masking", "off"))
TABLE = Table("mesh", "Mesh", "masking",
              (Column("RMSE, cm", 1, 100.0, True, "no mesh"), Column("of so many", 0)),
              (Row("masked", VARIANT, ("mesh.rmse_m", None), {12: (6.0,)}),
               Row("unmasked", OTHER, ("mesh.rmse_m", lambda report: report["count"]))))


class Given:
    """A runner that has its reports: `reports` by seed and variant."""

    def __init__(self, reports):
        self.reports = reports

    def known(self, log, variant):
        report = self.reports.get((log.seed, variant.name))
        return report, None if report else "not run yet"


def filled(reports, seeds=(1, 2, 3), people=(12,)):
    logs = [table_runs.simulated("apartment", 5.0, count, seed) for seed in seeds
            for count in people]
    return table_report.fill(TABLE, logs, Given(reports))


def mesh(rmse, count=40):
    return {"mesh": {"rmse_m": rmse}, "count": count}


class Figures(unittest.TestCase):
    def test_mean_deviation_and_median_over_seeds(self):
        lines = filled({(1, "masked"): mesh(0.03), (2, "masked"): mesh(0.04),
                        (3, "masked"): mesh(0.08)})
        cell = lines[0]["cells"][0]
        self.assertAlmostEqual(5.0, cell["mean"])
        self.assertAlmostEqual(7.0 ** 0.5, cell["sd"])
        self.assertAlmostEqual(4.0, cell["median"])
        self.assertEqual({1: 3.0, 2: 4.0, 3: 8.0}, cell["by_seed"])
        text = table_report.markdown_of(TABLE, lines)
        self.assertIn("| people | masking | paper, cm | RMSE, cm | of so many |", text)
        self.assertIn("| 12 | masked | 6 | 5.0 ± 2.6 (4.0) |  |", text)

    def test_one_seed_has_no_deviation(self):
        text = table_report.markdown_of(TABLE, filled({(1, "masked"): mesh(0.03)}, seeds=(1,)))
        self.assertIn("| 12 | masked | 6 | 3.0 |  |", text)

    def test_cells_without_figures_say_why(self):
        text = table_report.markdown_of(TABLE, filled(
            {(1, "masked"): mesh(None), (2, "masked"): mesh(0.02), (1, "unmasked"): mesh(0.03)},
            seeds=(1, 2)))
        self.assertIn("| 12 | masked | 6 | 2.0, 1 of 2 [1] |  |", text)
        self.assertIn("| 12 | unmasked | - [2] | 3.0, 1 of 2 [3] | 40, 1 of 2 [3] |", text)
        for line in ("[1] no mesh", "[2] not in the paper", "[3] not run yet"):
            self.assertIn(line, text)

    def test_a_recorded_log_stands_by_its_name(self):
        log = table_runs.Log("MH_01", "MH_01", None, log=pathlib.Path("a"), truth=pathlib.Path("b"))
        lines = table_report.fill(TABLE, [log], Given({(None, "masked"): mesh(0.03)}))
        text = table_report.markdown_of(TABLE, lines)
        self.assertIn("| log | masking |", text)
        self.assertIn("| MH_01 | masked | - [1] | 3.0 |  |", text)

    def test_zero_is_a_figure(self):
        text = table_report.markdown_of(TABLE, filled({(1, "unmasked"): mesh(0.0, 0)}, seeds=(1,)))
        self.assertIn("| 12 | unmasked | - [2] | 0.0 | 0 |", text)

    def test_each_row_has_a_cell_for_each_column(self):
        for table in paper_tables.TABLES.values():
            with_paper = sum(column.paper for column in table.columns)
            for row in table.rows:
                self.assertEqual(len(table.columns), len(row.cells), row.label)
                for numbers in row.paper.values():
                    self.assertLessEqual(len(numbers), with_paper, row.label)

    def test_files_hold_the_tables_and_where_they_come_from(self):
        lines = filled({(1, "masked"): mesh(0.03)}, seeds=(1,))
        logs = [table_runs.simulated("apartment", 5.0, 12, 1)]
        runner = types.SimpleNamespace(
            build="0123", key=lambda log, variant: variant.name,
            scores=types.SimpleNamespace(known={"masked": {"date": "2020-07-12T00:00:00+00:00"}}))
        origin = table_report.provenance("./dev tables mesh", logs, runner, [VARIANT, OTHER], True)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "results" / "mesh-small"
            table_report.publish(path, "Title", "See {evaluation}.", origin, [(TABLE, lines)])
            text = path.with_suffix(".md").read_text()
            content = json.loads(path.with_suffix(".json").read_text())
        self.assertIn(table_report.markdown_of(TABLE, lines), text)
        self.assertIn("| seeds | 12 people: 1 |", text)
        self.assertIn("| runs | 1, 1 are missing |", text)
        self.assertIn("`./dev tables mesh`", text)
        self.assertEqual(3.0, content["tables"][0]["lines"][0]["cells"][0]["mean"])
        for name in ("commit", "machine", "date", "command", "seeds", "programs_sha256"):
            self.assertTrue(content[name], name)


class Command(unittest.TestCase):
    def test_folders_of_the_machine_stay_out_of_it(self):
        self.assertEqual(
            "./dev tables mesh --seeds 1 2 --variants 'own poses'",
            paper_tables.command_of(["mesh", "--bin", "/a/bin", "--seeds", "1", "2", "--folder",
                                     "/b", "--out", "c", "--variants", "own poses"]))

    def test_usage(self):
        for words in (["rooms", "--log", "a", "--truth", "b"], ["odometry", "--log", "a"],
                      ["rooms", "--first", "5"],
                      ["tables"], []):
            done = support.run(sys.executable, TABLES, *words)
            self.assertEqual(2, done.returncode, done.stderr)


class SmallestRun(unittest.TestCase):
    """Two seconds of the apartment: too short for good figures, enough for all of the way."""

    def test_runs_once_and_goes_on(self):
        with tempfile.TemporaryDirectory() as folder:
            words = ["rooms", "--small", "--seconds", "2", "--people", "2", "--mesh-samples",
                     "5000", "--simulate", "--rate 5 --keyframe-every 1", "--ingest",
                     "--voxel 0.1", "--variants", "true poses, masked", "--drop", "--bin",
                     support.BIN, "--folder", os.path.join(folder, "data"), "--out",
                     os.path.join(folder, "out")]
            done = support.run(sys.executable, TABLES, *words)
            self.assertEqual(0, done.returncode, done.stderr)
            self.assertIn("simulating", done.stderr)
            self.assertRegex(done.stdout, r"\| 2 \| true poses \| - \[1\] \| \d+\.\d\d \|")
            self.assertTrue(os.path.exists(os.path.join(folder, "out", "rooms-small.md")))
            # The log was dropped; the score was kept, also for another table of the same maps.
            self.assertEqual(["scores.json"], os.listdir(os.path.join(folder, "data")))
            again = support.run(sys.executable, TABLES, *["mesh", *words[1:]])
            self.assertEqual(0, again.returncode, again.stderr)
            self.assertNotIn("simulating", again.stderr)
            self.assertRegex(again.stdout, r"\| 2 \| true poses, masked \| - \[1\] \| \d+\.\d \|")

    def test_parts_of_a_log_come_from_one_map_and_masks_need_people(self):
        with tempfile.TemporaryDirectory() as folder:
            done = support.run(sys.executable, TABLES, "odometry", "--world", "apartment",
                               "--seconds", "4", "--people", "0", "--seeds", "12", "--first", "2",
                               "--variants", "dvio", "--simulate", "--rate 10", "--bin",
                               support.BIN, "--folder", os.path.join(folder, "data"), "--out",
                               os.path.join(folder, "out"))
            self.assertEqual(0, done.returncode, done.stderr)
            # Two scores of one map, which takes two lines; with masks there would be four.
            self.assertIn("2 of 2 scores to make", done.stderr)
            self.assertEqual(2, done.stderr.count("dvio, masks off"), done.stderr)
            whole, first = done.stdout.split("the first 2 s")
            self.assertRegex(whole, r"\| 0 \| dvio, masks off \|")
            self.assertRegex(first, r"\| 0 \| dvio, masks off \|")
            self.assertNotIn("masks on", first)
            ways = [float(part.split("| 0 | dvio")[1].split("|")[-3]) for part in (whole, first)]
            self.assertLess(ways[1], ways[0])

    def test_the_task_script_takes_each_table_and_no_other_word(self):
        for table in (*paper_tables.TABLES, "all", "tracks"):
            with tempfile.TemporaryDirectory() as folder:
                done = support.run(os.path.join(support.ROOT, "dev"), "tables", table, "--bin",
                                   folder)
                self.assertNotEqual(0, done.returncode)
                self.assertIn('not "tracks"' if table == "tracks" else "there is no dsg-simulate",
                              done.stderr)

    def test_a_failed_run_is_said_and_leaves_a_mark(self):
        with tempfile.TemporaryDirectory() as folder:
            log = os.path.join(folder, "log")
            os.makedirs(log)
            done = support.run(sys.executable, TABLES, "odometry", "--log", log, "--truth", log,
                               "--variants", "dvio, masks off", "--bin", support.BIN, "--folder",
                               os.path.join(folder, "data"), "--out", os.path.join(folder, "out"))
            self.assertEqual(1, done.returncode, done.stderr)
            self.assertIn("dsg-ingest failed with exit", done.stdout)


if __name__ == "__main__":
    unittest.main()
