#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Label pictures beside an RGB-D folder: what is in the room gets its class."""

import os
import struct
import unittest
import zlib

import support

WIDTH, HEIGHT, FOCAL = 160, 120, 120.0
FRAMES = 12
WALL_M, BOX_M = 3.0, 1.8


def png(bits, channels, rows):
    """A PNG of whole numbers; no filters."""
    form = ">%d%s" % (len(rows[0]), "B" if bits == 8 else "H")
    raw = b"".join(b"\0" + struct.pack(form, *row) for row in rows)
    head = struct.pack(">IIBBBBB", len(rows[0]) // channels, len(rows), bits,
                       2 if channels == 3 else 0, 0, 0, 0)

    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) +
            chunk(b"IEND", b""))


class Labels(support.ProgramsTest):
    def write(self, name, data):
        path = self.path(name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as f:
            f.write(data if isinstance(data, bytes) else data.encode())

    def make_log(self):
        """A camera moves to the right before a wall with a box of 0.6 m, 1.8 m ahead."""
        tables = {"rgb": "", "depth": ""}
        poses = ""
        for i in range(FRAMES):
            stamp = f"160000000{i // 10}.{i % 10}0"
            x = 0.04 * i - 0.2
            depth, label, color = [], [], []
            for v in range(HEIGHT):
                high = abs((v - HEIGHT / 2) * BOX_M / FOCAL) < 0.3
                box = [high and abs(x + (u - WIDTH / 2) * BOX_M / FOCAL) < 0.3
                       for u in range(WIDTH)]
                depth.append([int(5000 * (BOX_M if b else WALL_M)) for b in box])
                label.append([17 if b else 4 for b in box])
                color.append([c for b in box for c in ((200, 40, 40) if b else (90, 90, 90))])
            self.write(f"log/rgb/{stamp}.png", png(8, 3, color))
            self.write(f"log/depth/{stamp}.png", png(16, 1, depth))
            self.write(f"labels/{stamp}.png", png(8, 1, label))
            for kind in tables:
                tables[kind] += f"{stamp} {kind}/{stamp}.png\n"
            # Looks along y of the map, z up.
            poses += f"{stamp} {x} 0 1.2 -0.70710678 0 0 0.70710678\n"
        for kind, table in tables.items():
            self.write(f"log/{kind}.txt", table)
        self.write("log/groundtruth.txt", poses)
        self.write("log/camera-intrinsics.txt",
                   f"{FOCAL} 0 {WIDTH / 2}\n0 {FOCAL} {HEIGHT / 2}\n0 0 1\n")
        self.write("labels/labels.csv", "id,name\n4,wall\n17,cabinet\n")

    def test_what_is_labelled_has_its_class(self):
        self.make_log()
        self.ok("dsg-ingest", "--store", "s", "--map", "m", "--labels", "labels", "--strict", "log")
        self.assertIn("cabinet", self.ok("dsg", "ls", "--store", "s", "--map", "m", "--layer",
                                         "objects"))
        done = support.run("dsg-ingest", "--store", "plain", "--map", "m", "log", cwd=self.folder)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertNotIn("cabinet", self.ok("dsg", "ls", "--store", "plain", "--map", "m",
                                            "--layer", "objects"))
        os.remove(self.path("labels", "1600000000.00.png"))
        self.refused(1, ["1 of 12 pictures of depth0 have no label picture"], "dsg-ingest",
                     "--store", "none", "--map", "m", "--labels", "labels", "--strict", "log")
        self.assertFalse(os.path.exists(self.path("none", "m")))
        self.refused(2, ["--labels nowhere"], "dsg-ingest", "--store", "none", "--map", "m",
                     "--labels", "nowhere", "log")

    def test_a_network_needs_its_classes_and_sound_numbers(self):
        self.write("poses.txt", "1.5 1 2 3 0 0 0 1\n")
        self.write("classes.txt", "wall\nchair\n")
        self.write("no.onnx", "no network")
        ingest = ["dsg-ingest", "--store", "none", "--map", "m", "poses.txt", "--segmenter"]
        self.refused(2, ["go together"], *ingest, "no.onnx")
        with_classes = [*ingest, "no.onnx", "--segmenter-classes", "classes.txt"]
        self.refused(1, ["no.onnx"], *with_classes)
        self.refused(2, ["--segmenter-mean 1,2 is neither"], *with_classes, "--segmenter-mean",
                     "1,2")
        self.refused(2, ["--segmenter-scale 1/0 is neither"], *with_classes, "--segmenter-scale",
                     "1/0")
        self.refused(1, ["gone.onnx"], *ingest, "gone.onnx", "--segmenter-classes", "classes.txt")
        self.assertFalse(os.path.exists(self.path("none", "m")))


if __name__ == "__main__":
    unittest.main()
