#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The README keeps its word: its demo runs, and prints the answers that the page shows."""

import os
import re
import subprocess
import unittest

import support

README = os.path.join(support.ROOT, "README.md")
BLOCK = re.compile(r"^```console\n(.*?)^```", re.DOTALL | re.MULTILINE)
# Figures that differ from run to run and machine to machine.
VARYING = re.compile(r"\d+\.\d s$|[\d.]+ [kMG]?B \(\d+ bytes\)|kill -TERM \d+")


def settled(text):
    """Lines without what varies and without blanks at the ends."""
    return [VARYING.sub("#", line).strip() for line in text.split("\n") if line.strip()]


class Readme(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with open(README, encoding="utf-8") as f:
            cls.blocks = BLOCK.findall(f.read())

    def test_names_the_two_commands(self):
        commands = [line[2:] for block in self.blocks for line in block.split("\n")
                    if line.startswith("$ ./dev ")]
        self.assertIn("./dev demo", commands)
        self.assertIn("./dev test", commands)

    def test_the_demo_prints_what_the_page_shows(self):
        block = next(b for b in self.blocks if b.startswith("$ ./dev demo\n"))
        # DSG_BIN makes ./dev demo skip the build and take the programs that are being tested.
        done = subprocess.run([os.path.join(support.ROOT, "dev"), "demo"], text=True,
                              capture_output=True, stdin=subprocess.DEVNULL, check=False,
                              timeout=support.TIMEOUT_S,
                              env=dict(support.environment(), DSG_BIN=support.BIN))
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        printed = settled(done.stdout)
        for line in settled(block)[1:]:
            if line != "...":
                self.assertIn(line, printed)


if __name__ == "__main__":
    unittest.main()
