#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How many poses a second come into numpy over the HTTP port, kept and passing. Prints medians and
best runs; needs Debian's python3-numpy. A private server listens on a unix socket."""

import os
import statistics
import sys
import time
import unittest

import python_support
import support

POSES_A_PERSON = 50_000
PEOPLE = 40
RUNS = 5

python_support.run_with("numpy")
if not python_support.has("numpy"):
    print("skipped: needs python3-numpy")
    sys.exit(0)

# What must stand behind that.
import dsgdb  # noqa: E402


class Speed(support.ProgramsTest):
    def test_poses_come_as_columns(self):
        os.makedirs(self.path("many"))
        with dsgdb.open(self.path("many"), writable=True) as db:
            lab = db.create_map("lab")
            lab.upsert_nodes([dsgdb.Node(f"H{i}", layer="agents", kind="human", name=f"h{i}")
                              for i in range(PEOPLE)])
            for i in range(PEOPLE):
                lab.append_poses(f"H{i}", [(t * 100_000_000, t * 0.001 + i, i * 0.5, 1.0, 0.0, 0.0,
                                            0.0, 1.0) for t in range(POSES_A_PERSON)])
            def kept():
                arrays = [track.to_arrays() for track in lab.tracks().values()]
                return sum(len(times) for times, _, _ in arrays)

            def passing():
                return sum(len(chunk.positions) for chunk in lab.pose_chunks())

            for name, read in (("kept in arrays", kept), ("in chunks", passing)):
                rates = []
                for _ in range(RUNS):
                    begin = time.monotonic()
                    count = read()
                    took = time.monotonic() - begin
                    self.assertEqual(PEOPLE * POSES_A_PERSON, count)
                    rates.append(count / took)
                print(f"{count} poses {name}: median {statistics.median(rates) / 1e6:.1f}, best "
                      f"{max(rates) / 1e6:.1f} M poses/s")
                self.assertGreater(statistics.median(rates), 1e6)


if __name__ == "__main__":
    unittest.main()
