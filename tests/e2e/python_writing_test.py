#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Python package writes: sessions go on, deltas are applied once, watches see them."""

import hashlib
import threading
import unittest

import python_support
import support

import dsgdb
from dsgdb import json_codec, v1

GRACE = dsgdb.Node("H7", layer="agents", kind="human", name="grace")


class Writing(python_support.HttpTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ingest("store", cls.simulate("office", people=2, seconds=20))
        cls.db = dsgdb.open(cls.path("store"), writable=True)
        cls.addClassCleanup(cls.db.close)

    def new_map(self, name):
        m = self.db.create_map(name, clock="CLOCK_LOG_MONOTONIC")
        m.upsert_nodes([GRACE])
        return m

    def test_a_patch_changes_what_it_names(self):
        m = self.new_map("patches")
        cup = dsgdb.Node("O1", layer="objects", kind="object", name="cup",
                         semantic_class=dsgdb.SemanticLabel(3, "cup"), confidence=0.0,
                         attributes={"color": dsgdb.AttributeValue(text="red"),
                                     "weight": dsgdb.AttributeValue(number=0.2)})
        table = dsgdb.Node("O2", layer="objects", kind="object", name="table")
        self.assertEqual(2, m.upsert_nodes([cup, table], message="two things"))
        m.upsert_edges([dsgdb.Edge("O1", "ON", "O2", weight=1.0)])
        m.upsert_nodes([dsgdb.Node("O1", name="my cup")])
        node = m.node("O1")
        self.assertEqual(("my cup", "cup", 0.0), (node.name, node.semantic_class.name,
                                                  node.confidence))
        self.assertEqual("red", node.attributes["color"].text)
        m.upsert_nodes([dsgdb.Node("O1", layer="objects", kind="object", name="a cup")],
                       replace=True)
        self.assertEqual({}, m.node("O1").attributes)
        self.assertEqual(["O1"], [edge.source for edge in m.edges(relation="ON")])
        told = self.ask("show", "O1", "--store", "store", "--map", "patches")
        self.assertEqual("a cup", told["node"]["name"])
        self.assertEqual("two things", m.revisions()[-2].message)

    def test_a_session_goes_on_where_another_process_stopped(self):
        m = self.new_map("sessions")
        first = m.session("tracker", author="test")
        first.append_poses("grace", [("+1s", 0, 0, 0)])
        again = m.session("tracker")
        self.assertEqual(1, again.last_sequence)
        revision = again.append_poses("H7", [("+2s", 1, 0, 0)])
        self.assertEqual((2, revision), (again.last_sequence, m.revision()))
        self.assertEqual("test", m.revisions()[1].author)
        # The older one does not know of that, and another delta under a taken number is refused.
        with self.assertRaises(dsgdb.AlreadyExists) as caught:
            first.append_poses("grace", [("+3s", 1, 0, 0)])
        self.assertEqual("SEQUENCE_REUSED", caught.exception.reason)
        self.assertEqual(2, len(m.track("grace")))

    def test_what_is_refused_changes_nothing(self):
        m = self.new_map("refusals")
        before = m.revision()
        for kind, write in (
                (dsgdb.InvalidArgument, lambda: m.append_poses("grace", [])),
                (dsgdb.InvalidArgument, lambda: m.append_poses("grace", [(1.5, 0, 0, 0)])),
                (dsgdb.InvalidArgument, lambda: m.append_poses("grace", [("+1s", 0, 0)])),
                (dsgdb.InvalidArgument, lambda: m.append_poses("grace", [dsgdb.TimedPose(1)])),
                (dsgdb.InvalidArgument,
                 lambda: m.append_poses("grace", [("+1s", 0, float("nan"), 0)])),
                (dsgdb.NotFound, lambda: m.append_poses("nobody", [("+1s", 0, 0, 0)])),
                (dsgdb.Error, lambda: m.upsert_edges([dsgdb.Edge("O1", "ON", "O2")])),
                (dsgdb.Error, lambda: m.upsert_nodes([dsgdb.Node("7")])),
                (dsgdb.InvalidArgument, lambda: m.upsert_nodes([dsgdb.Node(7)])),
                (dsgdb.InvalidArgument, lambda: m.at(revision=1).upsert_nodes([GRACE])),
                (dsgdb.Aborted, lambda: m.session().commit(dsgdb.GraphDelta(
                    parent_revision=0, nodes=(dsgdb.Node("H7", name="g"),))))):
            with self.assertRaises(kind):
                write()
        self.assertEqual(before, m.revision())
        session = m.session()
        with self.assertRaises(dsgdb.Error):
            session.upsert_nodes([dsgdb.Node("7")])
        self.assertEqual(before + 1, session.upsert_nodes([dsgdb.Node("H7", name="g")]))

    def test_many_poses_come_in_parts_and_back(self):
        m = self.new_map("many")
        count = 30_000
        m.append_poses("grace", ((i * 100_000_000, i * 1e-3, 0, 0, 0, 0, 0, 1)
                                 for i in range(count)))
        track = m.track("grace")
        self.assertEqual(count, len(track))
        self.assertEqual([i * 100_000_000 for i in range(count)], list(track.time_ns))
        self.assertLess(max(abs(x - i * 1e-3) for i, x in enumerate(track.x)), 2e-4)
        self.assertGreater(m.revision(), 2)

    def test_a_watch_tells_each_revision(self):
        m = self.new_map("watched")
        seen, ready = [], threading.Event()

        def watch():
            with dsgdb.open(self.path("store")) as other:
                for change in other.map("watched").watch(after=1, changes=True, idle=0.2):
                    seen.append(change)
                    ready.set()
                    if change.revision == 4:
                        return

        thread = threading.Thread(target=watch, daemon=True)
        thread.start()
        m.upsert_nodes([dsgdb.Node("H7", name="two")])
        self.assertTrue(ready.wait(support.READY_TIMEOUT_S))
        m.upsert_nodes([dsgdb.Node("H7", name="three")])
        m.upsert_nodes([dsgdb.Node("H7", name="four")])
        thread.join(support.READY_TIMEOUT_S)
        self.assertEqual([2, 3, 4], [change.revision for change in seen])
        self.assertEqual([["H7"]] * 3, [[node.after.id for node in change.diff.nodes]
                                        for change in seen])
        self.assertEqual("four", seen[2].diff.nodes[0].after.name)

    def test_a_watch_goes_on_when_the_server_comes_back(self):
        # One process writes a map at a time, so the private server is not asked for it.
        http = "unix:" + self.path("watched.sock")
        seen = []
        with dsgdb.open(http) as db:
            with self.http_server("store", http, "--http-write"):
                m = db.create_map("restarts", clock="CLOCK_LOG_MONOTONIC")
                m.upsert_nodes([GRACE])
                changes = m.watch(after=0, idle=0.2)
                seen.append(next(changes).revision)
            with self.http_server("store", http, "--http-write"):
                m.upsert_nodes([dsgdb.Node("H7", name="three")])
                seen.append(next(changes).revision)
                changes.close()
        self.assertEqual([1, 2], seen)

    def test_tags_move_and_go(self):
        m = self.new_map("tags")
        self.assertEqual(1, m.tag("start", note="as built").revision)
        m.upsert_nodes([dsgdb.Node("H7", name="two")])
        self.assertEqual(("grace", "two"), (m.at(tag="start").node("H7").name, m.node("H7").name))
        self.assertEqual(2, m.tag("start").revision)
        self.assertEqual("as built", m.tags()[0].note)
        m.untag("start")
        self.assertEqual(0, len(m.tags()))
        with self.assertRaises(dsgdb.NotFound):
            m.untag("start")

    def test_bodies_factors_and_assets_are_those_of_dsg(self):
        m = self.new_map("bodies")
        m.append_poses("grace", [(f"+{i}s", i, 0, 0, 0, 0, 0, 1) for i in range(4)])
        content = b"ply and so on" * 1000
        digest = hashlib.sha256(content).digest()
        shapes = tuple(v1.BodyShape(i * support.NS_PER_S, pose_coefficients=(0.5,) * 72,
                                    joints=(0.25,) * 72, vertices=(1.0, 2.0, 3.0))
                       for i in (1, 2))
        factors = (v1.PoseFactor("odometry", support.NS_PER_S, 2 * support.NS_PER_S,
                                 relative_pose=v1.Pose(v1.Vector3(1.0, 0.0, 0.0),
                                                       v1.Quaternion(0.0, 0.0, 0.0, 1.0))),)
        m.session().commit(dsgdb.GraphDelta(
            assets=(v1.Asset(digest, "model/ply", content),),
            shapes=(v1.ShapeAppend("H7", shapes=shapes),),
            factors=(v1.FactorAppend("H7", factors),)))
        told = self.ask("shape", "grace", "--store", "store", "--map", "bodies")
        read = m.shape("grace", "+1s", "+2s")
        self.assertEqual(json_codec.from_json(v1.AgentShape, told["shapes"][0]), read[0])
        self.assertEqual((2, 1), (len(told["shapes"]), len(read)))
        self.assertEqual((1.0, 2.0, 3.0), m.shape("grace", parts=[
            v1.ShapePart.SHAPE_PART_VERTICES])[1].shape.vertices)
        told = self.ask("factors", "grace", "--store", "store", "--map", "bodies")
        self.assertEqual(json_codec.from_json(v1.ListFactorsResponse, told).factors,
                         tuple(m.factors("grace")))
        self.assertEqual(factors, tuple(m.factors("grace")))
        self.assertEqual([], list(m.factors("grace", "+2s")))
        self.assertEqual(content, m.asset(digest))
        self.assertEqual(content, m.asset(digest.hex()))
        for wrong, kind in ((b"\0" * 32, dsgdb.NotFound), ("xy", dsgdb.InvalidArgument),
                            (b"short", dsgdb.InvalidArgument)):
            with self.assertRaises(kind):
                m.asset(wrong)

    def test_other_calls_are_made_with_their_messages(self):
        m = self.new_map("whole")
        last = list(self.db.api.prune(v1.PruneRequest(
            "whole", (v1.PrunePolicy(layer="agents"),), dry_run=True, allow_everything=True)))[-1]
        self.assertTrue(last.done)
        self.assertEqual(1, last.policies[0].matched.node_count)
        self.db.api.rename_map(v1.RenameMapRequest("whole", "renamed"))
        with self.assertRaises(dsgdb.NotFound):
            m.stats()
        self.db.api.drop_map(v1.DropMapRequest("renamed"))
        self.assertNotIn("renamed", self.db.maps())


if __name__ == "__main__":
    unittest.main()
