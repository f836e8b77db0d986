#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How soon the viewer shows a graph of 120,000 nodes, and what it fetches for it. Prints the
figures of each run and their medians."""

import os
import statistics
import subprocess
import unittest

import support
import viewer_support

RUNS = 5
BYTES_MAX = 10_000_000


class LargeMap(viewer_support.ViewerTest):
    @classmethod
    def make_store(cls):
        subprocess.run([os.path.join(support.BIN, "w2-store"), "store"], cwd=cls.folder,
                       check=True)

    def test_is_on_the_screen_soon_and_whole_in_few_bytes(self):
        first, graph, ready, received = [], [], [], []
        for _ in range(RUNS):
            self.open("&hide=mesh")
            figures = self.window.run("""
                const at = (name) => performance.getEntriesByName(name)[0].startTime;
                const sizes = performance.getEntriesByType('resource').map((one) =>
                    one.encodedBodySize);
                return [at('picture'), at('graph'), at('ready'),
                        sizes.reduce((sum, size) => sum + size, 0)];""")
            print("first picture {:.0f} ms, all nodes there {:.0f} ms, ready {:.0f} ms, "
                  "{} bytes".format(*figures))
            for into, value in zip((first, graph, ready, received), figures):
                into.append(value)
        print("median: first picture {:.0f} ms, all nodes there {:.0f} ms, ready {:.0f} ms"
              .format(*(statistics.median(one) for one in (first, graph, ready))))
        self.assertLess(max(received), BYTES_MAX)
        self.assertLess(statistics.median(first), 1000)
        self.picture("w2")


if __name__ == "__main__":
    unittest.main()
