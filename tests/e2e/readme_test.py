#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The README keeps its word: its demo runs, and its questions are answered as the page shows."""

import os
import re
import shlex
import shutil
import subprocess
import tempfile
import unittest

import support

README = os.path.join(support.ROOT, "README.md")
BLOCK = re.compile(r"^```console\n(.*?)^```", re.DOTALL | re.MULTILINE)
# Figures that differ from run to run and machine to machine.
VARYING = re.compile(r"\d+\.\d s$|[\d.]+ [kMG]?B \(\d+ bytes\)|kill -TERM \d+")


def settled(text):
    """Lines without what varies and without blanks at the ends."""
    return [VARYING.sub("#", line).strip() for line in text.split("\n") if line.strip()]


def questions(block):
    """(command, lines shown below it) for each command of dsg in a block."""
    found = []
    for line in block.split("\n"):
        if line.startswith("$ "):
            found.append((line[2:], []))
        elif found and line.strip():
            found[-1][1].append(line.rstrip())
    return [(command, shown) for command, shown in found if command.startswith("dsg ")]


class Readme(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with open(README, encoding="utf-8") as f:
            cls.blocks = BLOCK.findall(f.read())
        cls.folder = tempfile.mkdtemp(prefix="dsg-readme-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        # DSG_BIN makes ./dev demo skip the build and take the programs that are being tested.
        cls.demo = subprocess.run([os.path.join(support.ROOT, "dev"), "demo", cls.folder],
                                  text=True, capture_output=True, stdin=subprocess.DEVNULL,
                                  check=False, timeout=support.TIMEOUT_S,
                                  env=dict(support.environment(), DSG_BIN=support.BIN))

    def test_names_the_two_commands(self):
        commands = [line[2:] for block in self.blocks for line in block.split("\n")
                    if line.startswith("$ ./dev ")]
        self.assertIn("./dev demo", commands)
        self.assertIn("./dev test", commands)

    def test_the_demo_prints_what_the_page_shows(self):
        block = next(b for b in self.blocks if b.startswith("$ ./dev demo\n"))
        self.assertEqual(0, self.demo.returncode, self.demo.stdout + self.demo.stderr)
        printed = settled(self.demo.stdout)
        for line in settled(block)[1:]:
            if line != "...":
                self.assertIn(line, printed)

    def test_the_tour_answers_as_the_page_shows(self):
        self.assertEqual(0, self.demo.returncode, self.demo.stdout + self.demo.stderr)
        tour = questions(next(b for b in self.blocks if "$ dsg find " in b))
        self.assertGreaterEqual(len(tour), 10)
        environment = dict(support.environment(), DSG_STORE=os.path.join(self.folder, "store"))
        for command, shown in tour:
            with self.subTest(command):
                done = subprocess.run(shlex.split(command), text=True, capture_output=True,
                                      stdin=subprocess.DEVNULL, check=False, cwd=self.folder,
                                      timeout=support.TIMEOUT_S, env=environment)
                # A body that is free exits with 1.
                self.assertIn(done.returncode, (0, 1), done.stderr)
                self.assertEqual("", done.stderr)
                self.expect_shown(shown, [line.rstrip() for line in done.stdout.split("\n")
                                          if line.strip()])

    def expect_shown(self, shown, printed):
        """Every line in its order; "..." stands for any number of lines."""
        position = 0
        may_skip = False
        for line in shown:
            if line == "...":
                may_skip = True
                continue
            rest = printed[position:]
            self.assertIn(line, rest if may_skip else rest[:1])
            position += rest.index(line) + 1
            may_skip = False
        self.assertTrue(may_skip or position == len(printed), printed[position:])


if __name__ == "__main__":
    unittest.main()
