#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the viewer shows is what `dsg` says, at random revisions, times and pixels.

DSG_SEED repeats a run.
"""

import os
import random
import unittest

import support
import viewer_picks
import viewer_support
from viewer_support import READY

SEED = int(os.environ.get("DSG_SEED", "5"))
PAIRS = 20
PICKS = 100
STORE = ("--store", "store")
ARROW_DOWN, ENTER = "\ue015", "\ue007"
# Layers that are shown, and their groups in the legend.
GROUPS = {"agents": "agents", "objects": "objects", "places": "places", "rooms": "rooms",
          "buildings": "building"}


class Facts(viewer_support.ViewerTest):
    @classmethod
    def make_store(cls):
        """Many revisions; things that are taken away, gaps of tracks, and names that change."""
        cls.ok("dsg-simulate", "tracks", "--out", "office", "--seed", 7, "--people", 6, "--seconds",
               60, "--picks", 6, "--gap-rate", 4)
        cls.ok("dsg-ingest", "--store", "store", "--map", "office", "--commit-poses", 100,
               os.path.join("office", "log"))
        rng = random.Random(SEED)
        for layer in ("rooms", "objects"):
            nodes = cls.ask("ls", "--layer", layer, *STORE)["nodes"]
            for i, node in enumerate(rng.sample(nodes, 4)):
                cls.ok("dsg", "set", node["id"], "--name", f"the {layer} no. {i}", *STORE)
        cls.head = int(cls.ask("stats", *STORE)["head_revision"])

    def nodes(self, revision, at=None):
        more = ("--at", support.at(at - self.epoch_ns)) if at is not None else ()
        return self.ask("ls", "--revision", revision, "--limit", 10_000, *more, *STORE)["nodes"]

    def test_tables_are_what_dsg_says_at_random_revisions_and_times(self):
        rng = random.Random(SEED)
        seen = 0
        for _ in range(PAIRS):
            revision = rng.randint(1, self.head)
            stats = self.ask("stats", "--revision", revision, *STORE)
            begin = int(stats.get("first_pose_ns", self.epoch_ns))
            end = int(stats.get("last_pose_ns", begin))
            # The viewer has microseconds.
            at = rng.randint(begin // 1000, end // 1000) * 1000
            with self.subTest(seed=SEED, revision=revision, at=at):
                self.go(f"{self.url}&rev={revision}&at={at}")
                self.window.wait(f"{READY} || document.body.dataset.state === 'empty'")
                seen += self.check(stats, revision, at)
        # Most of them have people to be seen.
        self.assertGreater(seen, PAIRS)

    def check(self, stats, revision, at):
        self.assertEqual(str(revision), self.window.run("return document.body.dataset.revision"))
        counts = self.window.run("""return Object.fromEntries(
            [...document.querySelectorAll('#layers [id^=layer-]')].map((one) =>
                [one.id.slice(6), one.parentElement.querySelector('.count').textContent]))""")
        for layer in stats["layers"]:
            group = GROUPS.get(layer["name"])
            if group:
                self.assertEqual(layer["node_count"], counts[group], group)
        rows = {row[0]: row for row in self.rows()}
        due = {node["id"]: node for node in self.nodes(revision, at) if node["layer"] in GROUPS}
        self.assertEqual(set(due), set(rows))
        people = 0
        for node in due.values():
            _, name, kind, _, where = rows[node["id"]]
            self.assertEqual((node["kind"], node.get("name") or name), (kind, name))
            place = node.get("map_T_node", {}).get("position")
            if node["layer"] == "agents":
                people += 1
                if place is None:
                    self.assertEqual("in a gap of the track", where)
            if place is None:
                continue
            for axis, value in zip("xyz", where.split(",")):
                self.assertAlmostEqual(place.get(axis, 0), float(value), delta=0.0051, msg=node)
        return people

    def find(self, query, at):
        """What `dsg find` says as the list of the viewer does: id, name and facts."""
        hits = self.ask("find", query, "--at", support.at(at - self.epoch_ns), *STORE)["hits"]
        rooms = {node["id"]: node["name"] for node in
                 self.ask("ls", "--layer", "rooms", "--limit", 10_000, *STORE)["nodes"]}
        listed = []
        for hit in hits:
            node = hit["node"]
            room = next((rooms[id] for id in hit.get("ancestor_ids", ()) if id in rooms), None)
            facts = (node.get("semantic_class", {}).get("name"), node["layer"], room)
            listed.append([node["id"], node["name"], ", ".join(filter(None, facts))])
        return listed

    def listed(self):
        return self.window.run("""return [...document.querySelectorAll('#hits li')].map(
            (row) => [row.firstChild.dataset.id, row.firstChild.textContent,
                      row.lastChild.textContent.trim()]);""")

    def test_what_a_search_finds_is_listed_and_reached_by_keys(self):
        at = self.at_ns(30)
        self.open(f"&at={at}&q=chair")
        due = self.find("chair", at)
        self.assertGreater(len(due), 5)
        self.assertTrue(any(facts.count(", ") == 2 for _, _, facts in due), due)
        self.assertEqual(due, self.listed())
        self.assertTrue(self.text("hits").startswith(f"{len(due)} found"), self.text("hits"))
        self.window.keys("/", ARROW_DOWN, ARROW_DOWN, ENTER)
        self.window.wait("document.querySelector('#hits [aria-current]')")
        self.assertEqual([due[1][0]], self.window.run(
            "return [...document.querySelectorAll('#hits [aria-current]')].map("
            "(one) => one.dataset.id)"))
        self.assertEqual(due[1][0], self.window.run(
            "return document.querySelector('#inspector dd').textContent"))
        # The camera has gone there.
        place = {node["id"]: node for node in self.nodes(self.head)}[due[1][0]]["map_T_node"]
        target = self.window.run(
            "return import('/state.js').then(({app}) => app.camera.target)")
        for axis, value in zip("xyz", target):
            self.assertAlmostEqual(place["position"].get(axis, 0), value, delta=0.01)
        # A second before the same things are found: the list that is made anew keeps the focus.
        self.window.run("""
            document.querySelector('#hits ul').dataset.old = '1';
            document.activeElement.dispatchEvent(
                new KeyboardEvent('keydown', {key: ',', bubbles: true}));""")
        self.window.wait("document.querySelector('#hits ul:not([data-old])')")
        self.assertEqual(due[1][0], self.window.run("return document.activeElement.dataset.id"))
        # People are where they stay then.
        self.window.run("""
            document.getElementById('query').value = 'human';
            document.getElementById('search').requestSubmit();""")
        self.window.wait("document.querySelector('#hits button').dataset.id.startsWith('H')")
        self.assertEqual(self.find("human", at - support.NS_PER_S), self.listed())
        self.window.keys(viewer_support.ESCAPE)
        self.window.wait("document.getElementById('hits').hidden")

    def test_the_scale_is_that_of_the_middle_of_the_picture(self):
        camera = viewer_picks.Camera([20, 7, 0.5], 60, 0.4, 0.8)
        self.open(f"&cam={camera.address()}")
        scene = viewer_picks.Scene(self.nodes(self.head), self.nodes(self.head), 0)
        for distance in (60, 3, 11, 700):
            camera = viewer_picks.Camera(camera.target, distance, camera.yaw, camera.pitch)
            text, width, area = self.window.run("""
                const bar = document.getElementById('scale');
                const {width, height} = document.getElementById('scene').getBoundingClientRect();
                return import('/state.js').then(({app, changed}) => {
                  app.camera.distance = arguments[0];
                  changed(false);
                  return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(
                      () => done([bar.textContent, bar.getBoundingClientRect().width,
                                  [width, height]]))));
                });""", distance)
            metres = float(text.removesuffix(" m"))
            self.assertIn(f"{metres:e}"[0], "125", text)
            self.assertEqual(0, float(f"{metres:e}"[2:8]), text)
            # As long as it can be in 120 pixels.
            self.assertTrue(120 / 2.5 - 1 < width <= 120, (text, width))
            picture = viewer_picks.Picture(scene, camera, *area)
            right = [t + r * metres for t, r in zip(camera.target, camera.right)]
            self.assertAlmostEqual(picture.pixel(right)[0] - area[0] / 2, width, delta=0.2)

    def place_in_gap(self, node, at):
        """An agent in a gap of its track is drawn as a ring where it was last."""
        poses = self.ask("track", node["id"], "--to", support.at(at - self.epoch_ns), *STORE)
        node["map_T_node"] = poses["poses"][-1]["pose"]
        node["kind"] = viewer_picks.IN_GAP

    def test_random_clicks_select_what_is_there(self):
        rng = random.Random(SEED)
        counts = {"": 0}
        now, ever = self.nodes(self.head, self.at_ns(30)), self.nodes(self.head)
        for node in now:
            if "map_T_node" not in node and node["layer"] == "agents":
                self.place_in_gap(node, self.at_ns(30))
        for explode, distance in ((0, 60), (1, 70), (0, 9), (0, 3.5)):
            scene = viewer_picks.Scene(now, ever, explode)
            camera = viewer_picks.Camera(scene.middle() if distance > 20 else scene.somebody(rng),
                                         distance, round(rng.uniform(-3, 3), 3),
                                         round(rng.uniform(0.5, 1.3), 3))
            self.open(f"&at={self.at_ns(30)}&explode={explode}&cam={camera.address()}")
            self.window.wait("!document.getElementById('sentence').textContent"
                             ".includes('between samples')")
            area = self.window.run(
                "const {left, top, width, height} = document.getElementById('scene')"
                ".getBoundingClientRect(); return {left, top, width, height};")
            picture = viewer_picks.Picture(scene, camera, area["width"], area["height"])
            for _ in range(PICKS // 4):
                x, y = picture.random_pixel(rng)
                self.window.click(x + area["left"], y + area["top"])
                chosen = self.window.run(
                    "return document.querySelector('#inspector dd')?.textContent ?? ''")
                counts[chosen[:1]] = counts.get(chosen[:1], 0) + 1
                self.assertEqual("", picture.objection(x, y, chosen),
                                 f"seed {SEED}, pixel {x}, {y}, {camera.address()}")
            self.window.wait(f"location.hash.includes('cam={camera.address()}'"
                             ".replaceAll(',', '%2C'))")
        # The pixels were no empty ones.
        self.assertGreater(len(counts), 3, counts)
        self.assertLess(counts[""], PICKS / 2, counts)


if __name__ == "__main__":
    unittest.main()
