#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Answers of the Python package as numpy arrays, tables of pandas and graphs of networkx."""

import dataclasses
import sys
import unittest

import python_support
import support

python_support.run_with("numpy", "pandas", "networkx")
if not python_support.has("numpy", "pandas", "networkx"):
    print("skipped: needs python3-numpy, python3-pandas and python3-networkx")
    sys.exit(0)

# What must stand behind that.
import numpy  # noqa: E402
import pandas  # noqa: E402

import dsgdb  # noqa: E402
from dsgdb import v1  # noqa: E402

UTC_NS = pandas.DatetimeTZDtype("ns", "UTC")


class Tables(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ingest("store", cls.simulate("office", people=6, seconds=120))
        cls.db = dsgdb.open(cls.path("store"))
        cls.addClassCleanup(cls.db.close)
        cls.m = cls.db.map("office")

    def told(self, *command):
        return self.ask(*command, "--store", "store", "--map", "office")

    def test_poses_are_those_of_dsg(self):
        told = self.told("track", "alice")["poses"]
        rows = self.m.tracks(["alice"]).to_numpy()
        self.assertEqual(len(told), len(rows))
        self.assertEqual([int(pose["time_ns"]) for pose in told], rows["time_ns"].tolist())
        for axis in "xyz":
            self.assertEqual([pose["pose"]["position"][axis] for pose in told],
                             rows[axis].tolist())
        self.assertEqual({"H0"}, set(rows["agent"]))
        self.assertEqual({1}, set(rows["quality"].tolist()))
        norm = sum(rows[q] ** 2 for q in ("qx", "qy", "qz", "qw"))
        self.assertTrue(numpy.allclose(norm, 1.0))

    def test_gaps_are_rows_without_a_position(self):
        gaps = 0
        for agent, track in self.m.tracks(every="100ms").items():
            frame = track.to_pandas()
            steps = numpy.diff(frame.index.values)
            self.assertTrue((steps == numpy.timedelta64(100, "ms")).all(), agent)
            missing = frame[frame["quality"] == "IN_GAP"]
            self.assertTrue(missing[["x", "y", "z", "qx", "qw"]].isna().all(axis=None))
            self.assertFalse(frame[frame["quality"] != "IN_GAP"]["x"].isna().any())
            gaps += len(missing)
            for time in missing.index[:2]:
                self.assertEqual("IN_GAP", self.m.where(agent, time).quality)
                self.assertIsNone(self.m.where(agent, time).position)
        self.assertGreater(gaps, 0, "the simulated people have gaps")

    def test_times_are_timedeltas_without_a_unix_clock(self):
        frame = self.m.tracks().to_pandas()
        self.assertEqual(numpy.dtype("m8[ns]"), frame.index.dtype)
        self.assertEqual("time", frame.index.name)
        self.assertEqual(self.m.stats().pose_count, len(frame))
        self.assertEqual(7, frame.groupby("agent").ngroups)
        at = frame.index[100]
        row = frame.iloc[100]
        self.assertEqual(row["x"], self.m.where(row["agent"], at).position.x)
        empty = self.m.tracks([]).to_pandas()
        self.assertEqual((0, list(frame.columns)), (len(empty), list(empty.columns)))

    def test_lists_are_tables(self):
        told = self.told("who", "--room", "R0", "--from", "+20s", "--to", "+90s")["intervals"]
        frame = self.m.who("R0", "+20s", "+90s").to_pandas()
        self.assertEqual([row["agent_id"] for row in told], list(frame["agent_id"]))
        self.assertEqual([int(row["enter_ns"]) for row in told],
                         list((frame["enter"] / pandas.Timedelta(1, "ns")).astype("int64")))
        nodes = self.m.nodes(kind="object").to_pandas()
        self.assertIn("map_T_node.position.x", nodes.columns)
        self.assertIn("semantic_class.name", nodes.columns)
        log = self.m.revisions().to_pandas()
        self.assertEqual(UTC_NS, log["committed"].dtype)
        nobody = self.m.who(box=(900, 900, 0, 901, 901, 1)).to_pandas()
        self.assertEqual((0, list(frame.columns)), (len(nobody), list(nobody.columns)))
        self.assertEqual(frame["enter"].dtype, nobody["enter"].dtype)

    def test_open_ends_are_no_times(self):
        spec = dataclasses.replace(self.m.spec, clock=v1.Clock.CLOCK_UNIX)
        stays = [v1.PresenceInterval("H0", "a", dsgdb.TIME_MIN, dsgdb.TIME_MAX),
                 v1.PresenceInterval("H0", "a", 1_500_000_000_123_456_789, 1)]
        for clock in (self.m.spec, spec):
            frame = dsgdb.Rows(v1.PresenceInterval, stays, None, clock).to_pandas()
            self.assertTrue(frame["enter"].isna()[0] and frame["exit"].isna()[0])
            self.assertFalse(frame["enter"].isna()[1])
        self.assertEqual(UTC_NS, frame["enter"].dtype)
        self.assertEqual(1_500_000_000_123_456_789, frame["enter"][1].value)

    def test_the_graph_is_keyed_by_relation(self):
        graph = self.m.graph(layers=["rooms", "places"]).to_networkx()
        self.assertEqual({"rooms", "places"}, {data["layer"] for _, data in graph.nodes(data=True)})
        whole = self.m.graph().to_networkx()
        stats = self.m.stats()
        self.assertEqual((stats.node_count, stats.edge_count),
                         (whole.number_of_nodes(), whole.number_of_edges()))
        for edge in self.told("edges", "--source", "R3")["edges"]:
            data = whole.edges[edge["source"], edge["target"], edge["relation"]]
            self.assertEqual(edge["weight"], data["weight"])
        position = self.told("show", "O9")["node"]["map_T_node"]["position"]
        self.assertEqual((position["x"], position["y"], position["z"]),
                         whole.nodes["O9"]["position"])
        self.assertEqual("chair", whole.nodes["O9"]["class_name"])

    def test_differences_are_a_table(self):
        told = self.told("diff", "2")
        frame = self.m.diff(2).to_pandas()
        self.assertEqual(sum(len(told[key]) for key in ("nodes", "edges", "tracks", "mesh_blocks")),
                         len(frame))
        moved = frame[(frame["what"] == "node") & (frame["kind"] == "human")]["moved_m"]
        self.assertTrue((moved.dropna() > 0).any())

    def test_chunks_hold_the_poses_of_the_tracks(self):
        tracks = self.m.tracks()
        chunks = {agent: [chunk for chunk in self.m.pose_chunks() if chunk.agent_id == agent]
                  for agent in tracks}
        for agent, track in tracks.items():
            times, positions, orientations = track.to_arrays()
            of = chunks[agent]
            self.assertTrue(numpy.array_equal(times, numpy.concatenate([c.time_ns for c in of])))
            self.assertTrue(numpy.array_equal(
                positions, numpy.concatenate([c.positions for c in of])))
            self.assertTrue(numpy.array_equal(
                orientations, numpy.concatenate([c.orientations for c in of])))
        self.assertEqual([], list(self.m.pose_chunks([])))
        with self.assertRaises(ValueError):
            times[0] = 0

    def test_a_map_without_a_mesh_has_none(self):
        mesh = self.m.mesh()
        arrays = mesh.to_numpy()
        self.assertEqual(((0, 3), (0, 3), None),
                         (arrays.vertices.shape, arrays.faces.shape, arrays.colors))
        self.assertEqual(self.m.revision(), mesh.revision)


class UnixClock(support.ProgramsTest):
    """A map that the package itself writes."""

    EPOCH_NS = 1_700_000_000 * support.NS_PER_S

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        # Any store will do; this one is made by a log.
        cls.ingest("store", cls.simulate("office", people=2, seconds=20))
        cls.db = dsgdb.open(cls.path("store"), writable=True)
        cls.addClassCleanup(cls.db.close)
        cls.m = cls.db.create_map("lab", epoch_ns=cls.EPOCH_NS, lossless=True)
        cls.m.upsert_nodes([dsgdb.Node("H7", layer="agents", kind="human", name="grace")])

    def test_tables_come_back_as_they_were_written(self):
        times = pandas.date_range("2023-11-14T22:13:20.000000001", periods=50, freq="100ms",
                                  tz="UTC")
        self.m.append_poses("grace", ((time, i * 0.1, 2.0, 0.0, 0, 0, 0, 1)
                                      for i, time in enumerate(times)))
        frame = self.m.track("grace").to_pandas()
        self.assertEqual(UTC_NS, frame.index.dtype)
        self.assertEqual(list(times), list(frame.index))
        self.assertTrue(numpy.array_equal(frame["x"], numpy.arange(50) * 0.1))
        for at in (times[7], times[7].to_pydatetime(warn=False), "2023-11-14T22:13:20.700000001Z",
                   "+700ms"):
            self.assertAlmostEqual(0.7, self.m.where("grace", at).position.x, 5)
        with self.assertRaises(dsgdb.InvalidArgument):
            self.m.where("grace", times[7].tz_localize(None))
        with self.assertRaises(dsgdb.InvalidArgument):
            self.m.where("grace", pandas.NaT)

    def test_positions_alone_have_no_orientation(self):
        self.m.upsert_nodes([dsgdb.Node("H8", layer="agents", kind="human", name="hal")])
        self.m.append_poses("hal", [("+1s", 0, 0, 0), ("+2s", 1, 0, 0)])
        frame = self.m.track("hal").to_pandas()
        self.assertTrue(frame[["qx", "qy", "qz", "qw"]].isna().all(axis=None))
        self.assertIsNone(self.m.where("hal", "+1.5s").orientation)

    def test_a_mesh_is_arrays(self):
        positions = (0.1, 0.1, 0.1, 0.2, 0.1, 0.1, 0.1, 0.2, 0.1)
        blocks = (v1.MeshBlock(0, 0, 0, positions, colors=(0xff0000, 0x00ff00, 0x0000ff),
                               labels=(1, 1, 2), faces=(0, 1, 2)),
                  v1.MeshBlock(1, 0, 0, tuple(p + (2.0 if i % 3 == 0 else 0.0)
                                              for i, p in enumerate(positions)), faces=(2, 1, 0)))
        self.m.session().commit(dsgdb.GraphDelta(mesh_blocks=blocks))
        mesh = self.m.mesh().to_numpy()
        self.assertTrue(numpy.allclose(mesh.vertices[:3].ravel(), positions, atol=1e-4))
        self.assertEqual([[0, 1, 2], [5, 4, 3]], mesh.faces.tolist())
        self.assertEqual([[255, 0, 0], [0, 255, 0], [0, 0, 255], [0, 0, 0], [0, 0, 0], [0, 0, 0]],
                         mesh.colors.tolist())
        self.assertEqual([1, 1, 2, 0, 0, 0], mesh.labels.tolist())
        self.assertIsNone(mesh.instance_ids)
        self.assertEqual([0, 1, 2, 5, 4, 3], self.m.mesh().faces.tolist())
        one = self.m.mesh(box=(2.5, 0, 0, 4, 1, 1))
        self.assertEqual(3, len(one.to_numpy().vertices))


if __name__ == "__main__":
    unittest.main()
