#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""dsg-optimize as its users run it: figures, files, exit codes."""

import json
import math
import unittest

import support

FLAT = "100 0 0 100 0 400"


def ring(count, *extra):
    """A planar graph: a ring of poses a metre apart, the last closed by a loop, drifting a bit."""
    turn = 2 * math.pi / count
    lines = [f"EDGE_SE2 {i} {i + 1} 1 0.01 {turn:.17g} {FLAT}" for i in range(count - 1)]
    lines.append(f"EDGE_SE2 {count - 1} 0 1 0 {turn:.17g} {FLAT}")
    return "\n".join(lines + list(extra)) + "\n"


def edge(start, end, x, y, turn):
    return f"EDGE_SE2 {start} {end} {x} {y} {turn} {FLAT}"


class Optimize(support.ProgramsTest):
    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as out:
            out.write(text)
        return name

    def optimize(self, *arguments):
        return json.loads(self.ok("dsg-optimize", "--json", *arguments))

    def refused(self, code, *arguments):
        done = support.run("dsg-optimize", *arguments, cwd=self.folder)
        self.assertEqual(code, done.returncode, done.stderr)
        self.assertEqual("", done.stdout)
        return done.stderr

    def test_tells_its_figures(self):
        figures = self.optimize(self.write("ring.g2o", ring(40)))
        self.assertEqual(
            ["cost", "cost_se_sync", "start_cost", "iterations", "seconds", "converged", "poses",
             "edges", "loops", "kept_loops", "rejected_loops", "rejected", "skipped", "objective"],
            list(figures))
        self.assertTrue(figures["converged"])
        self.assertEqual((40, 40, 1, 1, 0), tuple(figures[key] for key in (
            "poses", "edges", "loops", "kept_loops", "rejected_loops")))
        self.assertEqual("se-sync", figures["objective"])
        self.assertAlmostEqual(figures["cost_se_sync"], 2 * figures["cost"], places=9)
        self.assertGreater(figures["cost"], 0)
        text = self.ok("dsg-optimize", "ring.g2o")
        self.assertIn(f"cost_se_sync    {figures['cost_se_sync']:.9g}\n", text)

    def test_writes_what_it_found(self):
        self.write("ring.g2o", ring(30))
        first = self.optimize("ring.g2o", "--out", "solved.g2o", "--objective", "geodesic")
        again = self.optimize("solved.g2o", "--start", "file", "--objective", "geodesic")
        self.assertAlmostEqual(first["cost"], again["start_cost"], places=9)
        self.assertAlmostEqual(first["cost"], again["cost"], places=9)
        self.optimize("ring.g2o", "--out", "twice.g2o", "--objective", "geodesic")
        with open(self.path("solved.g2o"), "rb") as a, open(self.path("twice.g2o"), "rb") as b:
            self.assertEqual(a.read(), b.read())

    def test_leaves_wrong_loops_out_of_what_it_writes(self):
        wrong = [edge(3, 20, 9, 9, 1), edge(8, 25, -7, 4, 2)]
        right = [edge(30, 29, -1, 0, -2 * math.pi / 40), edge(39, 1, 2, 0.2, math.pi / 10)]
        self.write("wrong.g2o", ring(40, *wrong, *right))
        figures = self.optimize("wrong.g2o", "--robust", "--out", "kept.g2o")
        self.assertEqual(2, figures["rejected_loops"], figures)
        self.assertEqual([(3, 20), (8, 25)], [(e["from"], e["to"]) for e in figures["rejected"]])
        with open(self.path("kept.g2o"), encoding="utf-8") as kept:
            text = kept.read()
        self.assertNotIn("EDGE_SE2 3 20 ", text)
        self.assertNotIn("EDGE_SE2 8 25 ", text)
        self.assertIn("EDGE_SE2 39 0 ", text)
        self.assertGreater(self.optimize("wrong.g2o")["cost"], 10 * figures["cost"])

    def test_takes_the_numbers_of_robustness(self):
        wrong = [edge(3, 20, 9, 9, 1), edge(8, 25, -7, 4, 2)]
        right = [edge(30, 29, -1, 0, -2 * math.pi / 40), edge(39, 1, 2, 0.2, math.pi / 10)]
        self.write("numbers.g2o", ring(40, *wrong, *right))
        usual = self.optimize("numbers.g2o", "--robust")
        del usual["seconds"]
        same = self.optimize("numbers.g2o", "--robust", "--loop-pairs", "2000000")
        del same["seconds"]
        self.assertEqual(usual, same)
        self.assertIn("--loop-wrong-count", self.ok("dsg-optimize", "--help-all"))
        self.assertNotIn("--loop-wrong-count", self.ok("dsg-optimize", "--help"))
        said = self.refused(2, "numbers.g2o", "--loop-wrong-count", "1")
        self.assertIn("without --robust", said)
        self.assertIn("1e-09 to 100", self.refused(2, "numbers.g2o", "--robust",
                                                   "--loop-wrong-count", "101"))

    def test_counts_the_lines_it_skips(self):
        self.write("skips.g2o", ring(10, "EDGE_SE2 0 1 1 0 0 -1 0 0 1 0 1", "VERTEX_XY 3 1 2"))
        done = support.run("dsg-optimize", "--json", "skips.g2o", cwd=self.folder)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual({"information matrix not positive definite": 1, "line of another kind": 1},
                         json.loads(done.stdout)["skipped"])
        self.assertIn("skips.g2o: note: line 11: left out: information matrix", done.stderr)

    def test_refuses_bad_files_and_flags(self):
        self.write("bad.g2o", ring(10, "EDGE_SE2 0 5 1 nan 0 1 0 0 1 0 1"))
        self.assertIn("bad.g2o:11: field y is \"nan\"", self.refused(1, "bad.g2o"))
        self.assertIn("nowhere.g2o", self.refused(1, "nowhere.g2o"))
        self.write("good.g2o", ring(10))
        self.refused(2, "good.g2o", "--objective", "best")
        self.refused(2)
        self.assertIn("is the file that is read", self.refused(2, "good.g2o", "--out", "good.g2o"))
        self.assertIn("no/such", self.refused(2, "good.g2o", "--out", "no/such/file.g2o"))


if __name__ == "__main__":
    unittest.main()
