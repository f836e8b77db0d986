#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The viewer in a real browser: what it says is what `dsg` says, and names from logs stay text."""

import os
import re
import subprocess
import unittest

import browser
import support
import viewer_support
from viewer_support import READY


class Viewer(viewer_support.ViewerTest):
    def test_the_token_leaves_the_address_and_the_page_is_quiet(self):
        self.window.messages()
        self.open()
        self.assertNotIn("token", self.window.run("return location.href"))
        self.assertEqual([], self.window.messages())

    def test_says_the_revision_and_where_people_are(self):
        self.open("&at=" + str(self.at_ns(30)))
        stats = self.ask("stats", "--store", "store", "--map", "office")
        self.assertEqual(stats["head_revision"], self.window.run(
            "return document.body.dataset.revision"))
        self.window.keys("t")
        self.window.wait("document.querySelectorAll('#table tr').length > 3")
        rows = self.window.run("""return [...document.querySelectorAll('#table tr')].map(
            (row) => [...row.cells].map((cell) => cell.textContent.trim()))""")
        people = [row for row in rows if row[2] == "human"]
        self.assertTrue(people)
        for row in people:
            said = self.ask("where", row[0], "--at", "+30s", "--store", "store", "--map", "office")
            if said["quality"] == "IN_GAP":
                self.assertEqual("in a gap of the track", row[4])
                continue
            at = said["pose"]["position"]
            shown = [float(value) for value in row[4].split(",")]
            for axis, value in zip("xyz", shown):
                self.assertAlmostEqual(at[axis], value, delta=0.02, msg=f"{row}")
        self.picture("table")
        self.window.keys("t")

    def test_a_thinned_log_shows_everybody_at_its_end_and_between_samples(self):
        self.ingest("long", self.simulate("long-log", people=3, seconds=150))
        store = ("--store", "long")
        stats = self.ask("stats", *store)
        with self.served("long") as url:
            for at in (int(stats["last_pose_ns"]), int(stats["last_pose_ns"]) - 37_123_456_000):
                self.go(f"{url}&at={at}")
                self.window.wait(READY)
                self.window.keys("t")
                self.window.wait("!document.getElementById('sentence').textContent"
                                 ".includes('between samples')")
                rows = dict(self.window.run("""
                  return [...document.querySelectorAll('#table tr')].slice(1).map(
                      (row) => [row.cells[0].textContent, row.cells[4].textContent]);"""))
                there = self.ask("ls", "--layer", "agents", "--at", support.at(
                    at - int(stats["map"]["epoch_ns"])), *store)["nodes"]
                self.assertTrue(there)
                for node in there:
                    place = node.get("map_T_node", {}).get("position")
                    said = rows.pop(node["id"])
                    if place is None:
                        self.assertEqual("in a gap of the track", said)
                        continue
                    shown = [float(value) for value in said.split(",")]
                    for axis, value in zip("xyz", shown):
                        self.assertAlmostEqual(place[axis], value, delta=0.0051)
                self.assertEqual([], [row for row in rows if row[0] in "Hr"])

    def test_draws_layers_in_place_and_apart(self):
        self.open()
        self.assertGreater(self.colors(), 20)
        self.picture("in_place")
        self.window.keys("x")
        self.window.wait("location.hash.includes('explode=1')")
        self.picture("apart")
        for key in "1234567":
            if key != "6" and key != "7":
                self.window.keys(key)
        self.window.wait("document.querySelectorAll('#layers input:checked').length <= 1")
        self.window.keys("6", "7")

    def test_of_layers_apart_none_is_before_another(self):
        self.open()
        angles = "return import('/state.js').then(({app}) => [app.camera.yaw, app.camera.pitch])"
        before = self.window.run(angles)
        self.window.keys("x")
        self.assertLess(self.window.run(angles)[1], 0.5)
        spans = self.window.run("""
          return Promise.all([import('/state.js'), import('/camera.js'), import('/show.js')]).then(
              ([{app}, {project}, {liftOf}]) => {
            const {scene, show, camera} = app;
            const matrix = camera.matrix(1.4);
            return ['objects', 'places', 'rooms', 'building'].map((group) => {
              const rows = scene.of(group).flatMap((node) => {
                const points = node.outline.length ? node.outline.map(([x, y]) => [x, y, node.zMin])
                                                   : [node.position];
                return points.filter(Boolean).map(([x, y, z]) => project(
                    matrix, [x, y, z + liftOf(scene, show, node)], 1400, 1000).y);
              });
              return [Math.min(...rows), Math.max(...rows)];
            });
          });""")
        for (top, bottom), (_, above_bottom) in zip(spans, spans[1:]):
            # Of a layer's height in the picture at most a tenth is behind the one above.
            self.assertLess(above_bottom, top + 0.1 * (bottom - top), spans)
        # The whole of it is to be seen, and in place again from where it was seen before.
        self.assertTrue(all(0 < top and bottom < 1000 for top, bottom in spans), spans)
        self.window.keys("x")
        self.assertEqual(before, self.window.run(angles))

    def test_paths_and_predictions_are_ribbons_and_the_legend_has_their_colours(self):
        legend = lambda text: self.window.run("""
            const row = [...document.querySelectorAll('#legend .row')].find(
                (one) => one.textContent.includes(arguments[0]));
            return getComputedStyle(row.querySelector('.mark')).color.match(/[0-9]+/g).map(Number);
            """, text)
        click = lambda text: self.window.run("""[...document.querySelectorAll('#inspector button')]
            .find((one) => one.textContent === arguments[0]).click()""", text)
        rooms = self.ask("ls", "--kind", "room", "--store", "store")["nodes"]
        room = max(rooms, key=lambda one: one["bounding_box"]["max"]["y"])["id"]
        # Floors would tint what lies on them.
        self.open(f"&hide=mesh,structures,rooms,building,places&at={self.at_ns(30)}&sel={room}"
                  "&q=chair")
        self.assertGreater(self.spots(legend("found")), 30)
        self.assertEqual(0, self.spots(legend("a path")))
        click("path from the middle")
        self.window.wait("document.getElementById('answer').textContent.includes('path of')")
        self.assertGreater(self.spots(legend("a path")), 30)
        somebody = next(node["id"] for node in self.ask("ls", "--layer", "agents", "--at", "+30s",
                                                        "--store", "store")["nodes"]
                        if node["kind"] == "human" and "map_T_node" in node)
        self.window.run("return import('/answers.js').then(({select}) => select(arguments[0]))",
                        somebody)
        before = self.colors()
        click("predict")
        self.window.wait("document.getElementById('answer').textContent.includes('%')")
        self.assertGreater(self.colors(), before)
        # Of another time nothing is predicted.
        self.window.keys(",")
        self.assertEqual("", self.text("answer"))
        wrong = self.window.run("""return import('/moving.js').then(({axesOf}) => {
          const wrong = [];
          const check = (covariance, ...due) => {
            const lengths = axesOf(covariance).map((axis) => Math.hypot(...axis));
            if (lengths.some((one, i) => !(Math.abs(one - due[i]) < 1e-9))) wrong.push(lengths);
          };
          check([4, 0, 0, 1, 0, 0], 4, 2);
          check([1, 0, 0, 4, 0, 0], 4, 2);
          check([2.5, 1.5, 9, 2.5, 9, 9], 4, 2);
          const [[x, y]] = axesOf([2.5, 1.5, 0, 2.5, 0, 0]);
          if (!(Math.abs(x - y) < 1e-9)) wrong.push([x, y]);
          if (axesOf([0, 0, 0, 0, 0, 0]) !== null) wrong.push('an ellipse of nothing');
          return wrong;
        });""")
        self.assertEqual([], wrong)

    def test_shows_the_mesh_of_a_sensor_log(self):
        self.ok("dsg-simulate", "sensors", "--out", "seen", "--world", "apartment", "--seconds",
                "2", "--people", "1", "--seed", "2", "--rate", "5", "--keyframe-every", "1")
        self.ok("dsg-ingest", "--store", "mesh", "--map", "home", "--poses", "gt", "--voxel", "0.1",
                os.path.join("seen", "log"))
        blocks = int(self.ask("stats", "--store", "mesh")["mesh_block_count"])
        self.assertGreater(blocks, 0)
        with self.served("mesh") as url:
            self.go(url)
            self.window.wait(READY)
            before = self.colors()
            self.window.keys("7")
            # A large block comes in pieces.
            self.window.wait(f"Number(document.body.dataset.mesh) >= {blocks}")
            self.assertGreater(self.colors(), 2 * before)
            self.picture("mesh")

    def test_finds_what_dsg_finds(self):
        self.open("&q=human")
        found = self.ask("find", "human", "--at", "+30s", "--store", "store", "--map", "office")
        self.open("&q=human&at=" + str(self.at_ns(30)))
        self.assertEqual(f"{len(found['hits'])} found, true at +30.0 s", self.window.run(
            "return document.getElementById('found').textContent"))
        self.open("&q=no+such+thing")
        self.assertIn("no", self.window.run("return document.getElementById('found').textContent"))

    def test_compares_with_another_revision(self):
        self.ingest("compared", self.simulate("compared-log", people=1, seconds=5))
        store = ("--store", "compared")
        before = self.ask("stats", *store)["head_revision"]
        cup = self.ask("ls", "--layer", "objects", *store)["nodes"][0]["id"]
        self.ok("dsg", "set", cup, "--name", "the other one", *store)
        after = self.ask("stats", *store)["head_revision"]
        changes = self.ask("diff", before, after, *store)["nodes"]
        count = lambda kind: sum(change["type"] == kind for change in changes)
        with self.served("compared") as url:
            self.go(f"{url}&diff={before}")
            self.window.wait(READY)
            said = f"+{count('ADDED')} -{count('REMOVED')} ~{count('CHANGED')}"
            self.assertEqual(
                f"{said} since revision {before}",
                self.window.run("return document.getElementById('found').textContent"))
            self.assertGreater(count("CHANGED"), 0)

    def test_a_link_shows_the_same_again(self):
        self.open("&at=" + str(self.at_ns(20)) + "&explode=0.50")
        self.window.keys("f")
        self.window.wait("location.hash.includes('cam=')")
        before = self.window.run("return location.href")
        facts = self.window.run("return document.getElementById('sentence').textContent")
        self.go(before)
        self.window.wait(READY)
        self.assertEqual(facts, self.window.run(
            "return document.getElementById('sentence').textContent"))

    def test_dsg_view_prints_an_address_that_answers(self):
        self.ingest("viewed", self.simulate("viewed-log", people=1, seconds=5))
        process = subprocess.Popen([os.path.join(support.BIN, "dsg"), "view", "viewed"],
                                   cwd=self.folder, env=support.environment(),
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            address = next(filter(None, (re.search(r"http://\S+#token=\S+", line)
                                         for line in process.stdout)))
            self.window.get(address[0])
            self.window.wait(READY)
        finally:
            process.terminate()
            self.assertEqual(0, process.wait(timeout=support.TIMEOUT_S))
            process.stdout.close()
        self.refused(2, ["nowhere"], "dsg", "view", "nowhere")

    def test_says_what_is_wrong(self):
        self.go(self.url.split("#")[0] + "#token=wrong")
        self.window.wait("document.body.dataset.state === 'token'")
        self.open()
        self.go(self.url + "&rev=99")
        self.window.wait("document.body.dataset.state === 'error'")
        said = self.window.run("return document.getElementById('banner').textContent")
        self.assertIn("99", said)
        self.window.run("document.querySelector('#banner button').click()")
        self.window.wait(READY)
        self.assertEqual("", self.text("banner"))
        self.open("&rev=one&cam=1,2&at=soon")
        for name in ("rev", "cam", "at"):
            self.assertIn(f'"{name}="', self.text("banner"))

    def test_offers_what_can_be_read_of_a_compacted_map(self):
        self.ingest("short", self.simulate("short-log", people=1, seconds=5))
        room = self.ask("ls", "--kind", "room", "--store", "short")["nodes"][0]["id"]
        self.ok("dsg", "set", room, "--name", "the den", "--store", "short")
        with self.served("short") as url:
            self.ok("dsg", "compact", "--server", "unix:short.sock")
            newest = self.ask("stats", "--store", "short")["head_revision"]
            self.go(url + "&rev=1")
            self.window.wait("document.body.dataset.state === 'error'")
            self.assertEqual(f"open revision {newest}", self.window.run("""
                const button = document.querySelector('#banner button');
                button.click();
                return button.textContent;"""))
            self.window.wait(READY)
            self.assertEqual(newest, self.window.run("return document.body.dataset.revision"))

    def test_waits_for_the_first_map(self):
        os.makedirs(self.path("empty"))
        with self.served("empty") as url:
            self.go(url)
            self.window.wait("document.body.dataset.state === 'no-maps'")

    def test_follows_new_revisions_and_says_that_the_server_went_away(self):
        self.ingest("live", self.simulate("live-log", people=1, seconds=5))
        with self.served("live") as url:
            self.go(url + "&live=1")
            self.window.wait(READY)
            before = int(self.window.run("return document.body.dataset.revision"))
            room = self.ask("ls", "--kind", "room", "--store", "live")["nodes"][0]["id"]
            self.ok("dsg", "set", room, "--name", "the den", "--server", "unix:live.sock")
            self.window.wait(f"Number(document.body.dataset.revision) === {before + 1} && {READY}")
            self.window.keys("t")
            self.window.wait("document.getElementById('table').textContent.includes('the den')")
            self.window.keys("t")
        self.window.wait("document.body.dataset.state === 'away'")
        self.assertGreater(self.colors(), 20)

    def test_without_webgl_there_is_a_plan(self):
        plain = browser.Browser("--disable-3d-apis")
        try:
            plain.get(self.url)
            plain.wait(READY + " && document.body.dataset.plan === '1'")
            self.assertIn("WebGL2", plain.run(
                "return document.getElementById('banner').textContent"))
            if viewer_support.PICTURES:
                with open(os.path.join(viewer_support.PICTURES, "plan.png"), "wb") as out:
                    out.write(plain.picture())
        finally:
            plain.close()

    def test_a_click_selects_what_is_there(self):
        self.open("&at=" + str(self.at_ns(30)))
        self.window.click(640, 300)
        self.window.wait("location.hash.includes('sel=')")
        title = self.window.run("return document.querySelector('#inspector h2').textContent")
        self.assertTrue(title)
        self.window.wait("document.querySelectorAll('#inspector .link').length > 0")
        self.picture("selected")
        self.window.keys(viewer_support.ESCAPE)
        self.window.wait("!location.hash.includes('sel=')")

    def test_names_are_never_markup(self):
        self.ok("dsg-ingest", "--store", "names", "--map", "office",
                self.simulate("names-log", people=2, seconds=20))
        payloads = ["<img src=x onerror=document.title='ran'>",
                    "<script>document.title='ran'</script>",
                    "\"><svg onload=document.title='ran'>", "javascript:document.title='ran'",
                    "{{constructor.constructor('document.title=1')()}}", "\u202egnp.exe",
                    "a" * 200]
        objects = self.ask("ls", "--layer", "objects", "--store", "names", "--map", "office")
        ids = [node["id"] for node in objects["nodes"]][:len(payloads)]
        for node, name in zip(ids, payloads):
            self.ok("dsg", "set", node, "--name", name, "--store", "names", "--map", "office")
        with self.served("names") as url:
            self.window.get("about:blank")
            self.window.messages()
            self.window.get(url)
            self.window.wait(READY)
            self.window.keys("t")
            self.window.wait("document.querySelectorAll('#table tr').length > 3")
            text = self.window.run("return document.getElementById('table').textContent")
            for name in payloads[:len(ids)]:
                self.assertIn(name.replace("\u202e", "[U+202E]"), text)
            self.assertEqual([], self.window.messages())
            self.assertEqual("dsgdb", self.window.run("return document.title"))

    def test_the_decoder_reads_what_is_whole_and_refuses_what_is_cut(self):
        self.open()
        wrong = self.window.run("""return import('/wire.js').then(({Reader, Writer}) => {
          const wrong = [];
          const values = [0n, 1n, 127n, 128n, (1n << 31n), (1n << 35n) - 1n, (1n << 63n) - 1n, -1n,
                          -(1n << 63n)];
          for (const value of values) {
            let read = null;
            const reader = new Reader(new Writer().number(6, value).done());
            reader.each({6: (r) => { read = r.int64(); }});
            if (read !== value) wrong.push(`${value} became ${read}`);
          }
          const whole = new Writer().number(1, 300).text(2, 'a name').number(9, 7).done();
          const fields = {1: (r) => r.varint(), 2: (r) => r.block()};
          let refused = 0;
          for (let length = 0; length < whole.length; ++length) {
            try {
              new Reader(whole.slice(0, length)).each(fields);
            } catch (error) {
              if (!(error instanceof RangeError)) wrong.push(String(error));
              ++refused;
            }
          }
          if (refused < whole.length - 4) wrong.push(`only ${refused} cuts were refused`);
          return wrong;
        });""")
        self.assertEqual([], wrong)

    def test_columns_that_are_cut_or_changed_are_refused(self):
        self.open()
        figures = self.window.run("""return (async () => {
          const [columns, {Client}, {takeToken}, {Writer}] = await Promise.all([
              import('/columns.js'), import('/rpc.js'), import('/address.js'),
              import('/wire.js')]);
          const request = new Writer().text(1, 'office').done();
          const read = {
            GetScene: (bytes) => {
              const {head, nodes, edges} = columns.readSceneMessage(bytes);
              if (nodes) columns.nodesOf(nodes, head?.origin ?? [0, 0, 0], 0n);
              if (edges) columns.edgesOf(edges, (row) => (row < 100000 ? 'x' : undefined), 0n);
            },
            GetTracks: (bytes) => columns.readTracksMessage(bytes, 0n),
          };
          const out = {whole: 0, refused: 0, wrong: []};
          let seed = 7;
          const below = (most) => {
            seed = (seed * 1103515245 + 12345) & 0x7fffffff;
            return seed % most;
          };
          const attempt = (method, bytes) => {
            try {
              read[method](bytes);
            } catch (error) {
              if (!(error instanceof RangeError)) out.wrong.push(`${method}: ${error}`);
              ++out.refused;
            }
          };
          for (const method of Object.keys(read)) {
            const client = new Client(takeToken());
            for await (const bytes of client.bytes(`QueryService/${method}`, request)) {
              read[method](bytes);
              ++out.whole;
              for (let i = 0; i < 300; ++i) {
                attempt(method, bytes.slice(0, below(bytes.length)));
                const changed = bytes.slice();
                changed[below(changed.length)] ^= 1 + below(255);
                attempt(method, changed);
              }
            }
          }
          return out;
        })();""")
        self.assertEqual([], figures["wrong"])
        self.assertGreater(figures["whole"], 3)
        # A change within a number is another number.
        self.assertGreater(figures["refused"], 300 * figures["whole"] // 2)

    def test_tracks_know_their_gaps_and_floors_keep_their_area(self):
        self.open()
        wrong = self.window.run("""return Promise.all([import('/scene.js'), import('/shapes.js')])
          .then(([{Track}, {triangulated}]) => {
            const wrong = [];
            const track = new Track();
            track.append([0, 1], [[0, 0, 0], [10, 0, 0]], []);
            track.append([9], [[20, 0, 0]], [0]);
            const expect = (time, x, known) => {
              const here = track.at(time);
              const is = here && [here.position[0], here.known];
              const due = x === null ? null : [x, known];
              if (JSON.stringify(is) !== JSON.stringify(due)) wrong.push(`${time}: ${is}`);
            };
            expect(-0.1, null);
            expect(0.5, 5, true);
            expect(1, 10, true);
            expect(5, 10, false);
            expect(9, 20, true);
            expect(9.1, null);
            const ell = [[0, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]];
            for (const outline of [ell, [...ell].reverse()]) {
              const area = triangulated(outline).reduce((sum, [a, b, c]) => sum + Math.abs(
                  (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2, 0);
              if (Math.abs(area - 6) > 1e-9) wrong.push(`area ${area}`);
            }
            return wrong;
          });""")
        self.assertEqual([], wrong)


if __name__ == "__main__":
    unittest.main()
