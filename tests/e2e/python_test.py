#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Python package answers what `dsg --json` answers, and says clearly what goes wrong."""

import contextlib
import datetime
import pickle
import socket
import threading
import unittest

import python_support
import support

import dsgdb
from dsgdb import json_codec, v1


class Answers(python_support.HttpTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ingest("store", cls.simulate("office", people=6, seconds=120))
        cls.ok("dsg", "tag", "first", "--revision", "2", "--note", "walls", "--store", "store")
        cls.db = dsgdb.open(cls.path("store"))
        cls.addClassCleanup(cls.db.close)
        cls.m = cls.db.map("office")

    def dsg(self, kind, *command):
        """What dsg answers, as a message."""
        return json_codec.from_json(kind, self.ask(*command, "--store", "store", "--map", "office"))

    def test_the_bytes_of_an_answer_say_what_dsg_prints(self):
        asked = {"map": "office", "agent": "alice", "at_ns": "30000000000"}
        self.assertEqual(self.ask("where", "alice", "--at", "+30s", "--store", "store"),
                         self.db.api.channel.unary("dsg.v1.QueryService/LocateAgent", asked, None,
                                                   True))

    def test_where(self):
        agents = [node.name for node in self.m.nodes(layer="agents")]
        self.assertEqual(7, len(agents))
        for agent in agents:
            for second in (1, 30, 77.7):
                with self.subTest(agent=agent, second=second):
                    self.assertEqual(
                        self.dsg(v1.LocateAgentResponse, "where", agent, "--at", f"+{second}s"),
                        self.m.where(agent, f"+{second}s"))
        alice = self.m.where("alice", "+30s")
        self.assertEqual(alice.pose.position, alice.position)
        self.assertEqual(3, len(list(alice.position)))
        self.assertEqual("INTERPOLATED", alice.quality)

    def test_times_in_all_their_forms(self):
        asked = self.m.where("alice", 30_000_000_000)
        for at in ("+30s", "+30", "+0.5m", "30000000000ns", datetime.timedelta(seconds=30)):
            self.assertEqual(asked, self.m.where("alice", at))
        now = datetime.datetime.now(datetime.timezone.utc)
        for at in (30.0, True, None, "30", "-30", "+30 s", "+", "", "soon", now,
                   "2014-06-25T16:58:44Z", datetime.datetime(2020, 1, 1), "+1e30d", 2 ** 63):
            with self.subTest(at=at), self.assertRaises(dsgdb.InvalidArgument) as caught:
                self.m.where("alice", at)
            self.assertEqual("FIELD_INVALID", caught.exception.reason)

    def test_tracks(self):
        for options, every in (([], None), (["--every", "500ms"], "500ms")):
            told = self.dsg(v1.GetTrajectoryResponse, "track", "alice", "--from", "+10s", "--to",
                            "+20s", *options)
            track = self.m.track("alice", "+10s", "+20s", every=every)
            self.assertEqual([pose.time_ns for pose in told.poses], list(track.time_ns))
            self.assertEqual(list(told.poses), list(track))
            self.assertEqual((told.agent_id, told.header.read_revision),
                             (track.agent_id, track.revision))
        whole = self.dsg(v1.GetTrajectoryResponse, "track", "alice")
        self.assertEqual(list(whole.poses), list(self.m.track("alice")))
        everybody = self.m.tracks()
        self.assertEqual(self.m.nodes(layer="agents").ids, list(everybody))
        self.assertEqual(self.m.stats().pose_count, sum(map(len, everybody.values())))

    def test_people(self):
        interval = ["--from", "+20s", "--to", "+90s"]
        who = self.m.who("R0", "+20s", "+90s")
        told = self.dsg(v1.ListPresenceResponse, "who", "--room", "R0", *interval)
        self.assertGreater(len(who), 0)
        self.assertEqual(list(told.intervals), list(who))
        self.assertEqual(told.observed_agent_count, who.reply.observed_agent_count)
        self.assertEqual(list(self.dsg(v1.ListPresenceResponse, "who", "--box",
                                       "0,0,-1,30,30,3").intervals),
                         list(self.m.who(box=(0, 0, -1, 30, 30, 3))))
        name = self.m.node("R0").name
        self.assertEqual(list(who), list(self.m.who(name, "+20s", "+90s")))
        met = self.m.met("alice", start="+20s", end="+90s", within_m=3.0)
        self.assertEqual(list(self.dsg(v1.ListEncountersResponse, "met", "alice", "--within", "3",
                                       *interval).encounters), list(met))
        self.assertEqual(list(self.dsg(v1.ListInteractionsResponse, "picked",
                                       "--all").interactions),
                         list(self.m.picked(include_abstained=True)))
        self.assertEqual(self.dsg(v1.PredictAgentResponse, "predict", "alice", "--at", "+30s",
                                  "--horizon", "2s"),
                         self.m.predict("alice", "+30s", horizon="2s"))

    def test_the_graph(self):
        for options, asked in (
                (["--kind", "room"], {"kind": "room"}),
                (["--layer", "agents", "--at", "+30s"], {"layer": "agents", "at": "+30s"}),
                (["--class", "chair"], {"class_name": "chair"}),
                (["--parent", "R1"], {"parent": "R1"}),
                (["--box", "0,0,0,5,5,3"], {"box": [(0, 0, 0), (5, 5, 3)]})):
            with self.subTest(asked=asked):
                told = self.dsg(v1.ListNodesResponse, "ls", *options)
                found = self.m.nodes(**asked)
                self.assertGreater(len(found), 0)
                self.assertEqual(list(told.nodes), list(found))
        self.assertEqual(list(self.dsg(v1.ListEdgesResponse, "edges").edges), list(self.m.edges()))
        few = self.m.edges(source="R3", limit=3)
        told = self.dsg(v1.ListEdgesResponse, "edges", "--source", "R3", "--limit", "3")
        self.assertEqual((list(told.edges), True), (list(few), few.has_more))
        self.assertEqual(self.dsg(v1.GetNodeResponse, "show", "O9"), self.m.show("O9"))
        self.assertEqual(list(self.dsg(v1.GetNeighborsResponse, "around", "O9").neighbors),
                         list(self.m.around("O9")))
        told = self.dsg(v1.GetSubgraphResponse, "subgraph", "B0", "--depth", "2")
        graph = self.m.subgraph("B0", depth_max=2)
        self.assertEqual((told.nodes, told.edges), (graph.nodes, graph.edges))
        whole = self.m.graph()
        stats = self.m.stats()
        self.assertEqual((stats.node_count, stats.edge_count),
                         (len(whole.nodes), len(whole.edges)))

    def test_search_and_space(self):
        told = self.dsg(v1.SearchNodesResponse, "find", "chair", "--near", "3,2,0", "-k", "5")
        found = self.m.find("chair", near=(3, 2, 0), limit=5)
        self.assertEqual(list(told.hits), list(found))
        self.assertEqual([hit.node.id for hit in told.hits], found.ids)
        self.assertEqual(told.canonical_query, found.reply.canonical_query)
        self.assertEqual(len(self.m.find("chair")), self.m.count("chair"))
        self.assertEqual(self.dsg(v1.ListNearestNodesResponse, "near", "3,2,0", "--k", "3",
                                  "--layer", "objects").nodes,
                         tuple(self.m.near([3, 2, 0], 3, layer="objects")))
        self.assertEqual(self.dsg(v1.PlanPathResponse, "path", "alice", "nearest chair", "--at",
                                  "+30s", "--radius", "0.2"),
                         self.m.path("alice", "nearest chair", at="+30s", radius_m=0.2))
        at = list(self.m.node("O9").map_T_node.position)
        told = self.dsg(v1.CheckCollisionResponse, "collide", "--capsule", "0.2,1", "--pose",
                        ",".join(map(repr, at)), "--objects")
        hit = self.m.collide(dsgdb.Capsule(0.2, 1.0), [at], against=["objects"])
        self.assertEqual((told.results[0], True), (hit, hit.hit))
        above = self.m.collide(dsgdb.Sphere(0.2), [(*at[:2], 50), (*at[:2], 60)], reach_m=60)
        self.assertEqual((False, True), (above.hit, above.clearance_m > 10))

    def test_history(self):
        self.assertEqual(self.ask("maps", "--store", "store")["maps"][0]["name"],
                         self.db.maps()[0])
        self.assertEqual(self.dsg(v1.GetMapStatsResponse, "stats"), self.m.stats())
        told = self.dsg(v1.ListRevisionsResponse, "log")
        revisions = self.m.revisions()
        self.assertEqual(list(told.revisions), list(revisions))
        self.assertFalse(revisions.has_more)
        two = self.m.revisions(2)
        self.assertEqual((list(told.revisions[:2]), True), (list(two), two.has_more))
        self.assertEqual([("first", 2)], [(tag.name, tag.revision) for tag in self.m.tags()])
        told = self.dsg(v1.DiffRevisionsResponse, "diff", "first")
        diff = self.m.diff("first")
        self.assertEqual((told.nodes, told.edges, told.tracks, told.to_revision),
                         (diff.nodes, diff.edges, diff.tracks, diff.to_revision))
        self.assertGreater(len(diff), 0)
        then, tagged = self.m.at(revision=2), self.m.at(tag="first")
        self.assertEqual(self.dsg(v1.GetMapStatsResponse, "stats", "--revision", "2"),
                         then.stats())
        self.assertEqual(then.stats(), tagged.stats())
        self.assertEqual(2, tagged.graph(layers=["rooms"]).revision)
        self.assertEqual(2, then.nodes(layer="rooms").revision)

    def test_what_is_wrong_is_said(self):
        for kind, reason, ask in (
                (dsgdb.NotFound, "AGENT_UNKNOWN", lambda: self.m.where("nobody", "+1s")),
                (dsgdb.OutOfRange, "TIME_OUTSIDE_TRACK", lambda: self.m.where("alice", "+1d")),
                (dsgdb.NotFound, "NODE_UNKNOWN", lambda: self.m.node("O99999")),
                (dsgdb.NotFound, "MAP_UNKNOWN", lambda: self.db.map("nowhere")),
                (dsgdb.NotFound, "CLASS_UNKNOWN", lambda: self.m.nodes(class_name="chiar")),
                (dsgdb.NotFound, "LAYER_UNKNOWN", lambda: self.m.graph(layers=["romos"])),
                (dsgdb.NotFound, "RELATION_UNKNOWN", lambda: self.m.edges(relation="OVER")),
                (dsgdb.NotFound, "TAG_UNKNOWN", lambda: self.m.diff("last")),
                (dsgdb.NotFound, "TAG_UNKNOWN", lambda: self.m.at(tag="last").stats()),
                (dsgdb.InvalidArgument, "FIELD_INVALID", lambda: self.m.at(tag="")),
                (dsgdb.InvalidArgument, "FIELD_INVALID", lambda: dsgdb.open("")),
                (dsgdb.OutOfRange, "REVISION_IN_FUTURE",
                 lambda: self.m.at(revision=10 ** 6).stats()),
                (dsgdb.InvalidArgument, "QUERY_MALFORMED", lambda: self.m.find("chair on (")),
                (dsgdb.InvalidArgument, "NUMBER_NOT_FINITE",
                 lambda: self.m.near((float("nan"), 0, 0))),
                (dsgdb.InvalidArgument, "FIELD_INVALID", lambda: self.m.near("3,2,0")),
                (dsgdb.InvalidArgument, "FIELD_INVALID", lambda: self.m.tracks("alice")),
                (dsgdb.InvalidArgument, "FIELD_INVALID", lambda: self.m.who()),
                (dsgdb.InvalidArgument, "FIELD_INVALID", lambda: self.m.nodes(limit=0)),
                (dsgdb.InvalidArgument, "FIELD_INVALID",
                 lambda: self.m.track("alice", every=datetime.timedelta(0))),
                (dsgdb.InvalidArgument, "FIELD_INVALID", lambda: self.m.where(7, "+1s"))):
            with self.assertRaises(kind) as caught:
                ask()
            error = caught.exception
            self.assertEqual(reason, error.reason, error)
            self.assertIn(reason, str(error))
        with self.assertRaises(dsgdb.OutOfRange) as caught:
            self.m.where("alice", "+1d")
        self.assertIn("last_ns", caught.exception.metadata)
        again = pickle.loads(pickle.dumps(caught.exception))
        self.assertEqual((str(again), again.metadata),
                         (str(caught.exception), caught.exception.metadata))

    def test_a_folder_is_read_only_unless_asked_for(self):
        with self.assertRaises(dsgdb.PermissionDenied) as caught:
            self.m.tag("second", 2)
        self.assertIn("--http-write", str(caught.exception))

    def test_many_threads_ask_at_a_time(self):
        told = self.m.where("alice", "+30s")
        answers, errors = [], []

        def ask():
            try:
                for _ in range(20):
                    answers.append(self.m.where("alice", "+30s") == told)
                    answers.append(len(self.m.track("alice", "+10s", "+20s")) > 50)
            except Exception as error:  # pylint: disable=broad-except
                errors.append(error)

        threads = [threading.Thread(target=ask) for _ in range(12)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(([], 480, True), (errors, len(answers), all(answers)))

    def test_a_stream_that_is_left_ends(self):
        request = v1.GetTrajectoryRequest(map="office", agent="alice")
        for _ in range(200):
            # More than the streams that a server keeps open.
            next(self.db.api.get_trajectory(request))
        self.assertGreater(len(self.m.track("alice")), 0)

    def test_each_call_can_be_made(self):
        api = self.db.api
        self.assertEqual("first", api.list_tags(v1.ListTagsRequest("office")).tags[0].name)
        batch = api.batch_locate_agents(v1.BatchLocateAgentsRequest(
            "office", instants=(v1.AgentInstant("alice", 30 * support.NS_PER_S),
                                v1.AgentInstant("nobody", 0))))
        self.assertEqual([0, 5], [result.status_code for result in batch.results])
        archive = b"".join(part.content for part in
                           api.read_archive(v1.ReadArchiveRequest("office")))
        self.assertGreater(len(archive), 1000)
        self.assertEqual(self.ok("dsg", "version").split()[1].rstrip(","), self.db.version())


class Port(python_support.HttpTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ingest("store", cls.simulate("office", people=3, seconds=60))

    def test_loopback_asks_for_the_token(self):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        with self.http_server("store", f"127.0.0.1:{port}") as url:
            place, _, token = url.partition("#token=")
            self.assertGreater(len(token), 20)
            with dsgdb.open(url) as db:
                self.assertEqual(["office"], db.maps())
                self.assertNotIn(token, repr(db))
            with dsgdb.open(place, token=token) as db:
                self.assertEqual(["office"], db.maps())
            for wrong in (place, place + "#token=" + "x" * len(token)):
                with dsgdb.open(wrong) as db, self.assertRaises(dsgdb.Unauthenticated):
                    db.maps()

    def test_no_server_is_said(self):
        for place in ("unix:" + self.path("nothing.sock"), "http://127.0.0.1:9"):
            with dsgdb.open(place) as db, self.assertRaises(dsgdb.Unavailable) as caught:
                db.maps()
            self.assertIn(place, str(caught.exception))
            self.assertIn("dsg-server --store", str(caught.exception))
        for place in ("ftp://127.0.0.1", "http://", "http://a/b", "http://a:b", "unix:",
                      "http://127.0.0.1#secret", "http://u:p@a:1", "unix:x#token=\u00e4"):
            with self.assertRaises(dsgdb.InvalidArgument, msg=place):
                dsgdb.open(place)

    def test_reads_are_repeated_and_writes_are_made_once(self):
        with self.http_server("store", "unix:" + self.path("real.sock"), "--http-write"):
            for cuts in (1, 3):
                proxy = python_support.CuttingProxy(self.path("real.sock"),
                                                    self.path(f"cut{cuts}.sock"), cuts)
                with dsgdb.open("unix:" + self.path(f"cut{cuts}.sock")) as db:
                    self.assertEqual(["office"], db.maps())
                proxy.close()
                self.assertEqual(cuts + 1, proxy.calls)
            with dsgdb.open("unix:" + self.path("real.sock")) as db:
                before = db.map("office").revision()
            proxy = python_support.CuttingProxy(self.path("real.sock"), self.path("write.sock"), 2)
            with dsgdb.open("unix:" + self.path("write.sock")) as db:
                with self.assertRaises(dsgdb.Unavailable):
                    db.api.set_tag(v1.SetTagRequest("office", "now"))
                self.assertEqual(1, proxy.calls)
                session = dsgdb.Session(dsgdb.Map(db.api, v1.MapSpec("office")))
                reply = session.commit(dsgdb.GraphDelta(nodes=(dsgdb.Node("O1", name="mine"),)))
                self.assertTrue(reply.replayed)
                self.assertEqual(3, proxy.calls)
                self.assertEqual(before + 1, reply.revision)
                self.assertEqual((before + 1, "mine"), (db.map("office").revision(),
                                                        db.map("office").node("O1").name))
            proxy.close()

    def test_what_is_no_server_of_ours_is_said(self):
        ok = b"HTTP/1.1 200 OK\r\n"
        for answer in (b"", b"\0" * 100, b"HTTP/1.1 404 Not Found\r\nContent-Length: 3\r\n\r\nno!",
                       ok + b"Content-Length: 2\r\n\r\n[]", ok + b"Content-Length: 9\r\n\r\n{}",
                       ok + b"Content-Length: 15\r\n\r\n{\"maps\": \"none\"}"[:-1] + b"}",
                       ok + b"Content-Length: 13\r\n\r\n{\"maps\": [3]}",
                       b"HTTP/1.1 500 X\r\nContent-Length: 12\r\n\r\n{\"code\": []}"):
            with self.subTest(answer=answer), self.answering(answer) as place, \
                    dsgdb.open(place, timeout=5) as db, self.assertRaises(dsgdb.Error):
                db.maps()

    def test_the_address_for_grpc_is_said(self):
        with self.http_server("store", "unix:" + self.path("http.sock")), \
                dsgdb.open("unix:" + self.path("grpc.sock")) as db, \
                self.assertRaisesRegex(dsgdb.Unavailable, "gRPC.*--http ADDRESS"):
            db.maps()

    def test_streams_that_break_are_said(self):
        end = b"\2\0\0\0\2{}"
        message = b"\0\0\0\0\21{\"agent_id\":\"H0\"}"
        for body, kind in ((message + end, None), (end, None), (b"", dsgdb.Unavailable),
                           (message, dsgdb.Unavailable), (message + end[:-1], dsgdb.Unavailable),
                           (b"\0\xff\xff\xff\xff{}", dsgdb.Internal),
                           (b"\1\0\0\0\2{}" + end, dsgdb.Internal),
                           (b"\0\0\0\0\2[]" + end, dsgdb.Internal),
                           (b"\0\0\0\0\x0b{\"poses\":1}" + end, dsgdb.Internal),
                           (b"\2\0\0\0\x0b{\"error\":1}", dsgdb.Internal),
                           (b"\2\0\0\0\x1e{\"error\":{\"code\":\"not_found\"}}", dsgdb.NotFound)):
            answer = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body)
            with self.subTest(body=body), self.answering(answer + body) as place, \
                    dsgdb.open(place, timeout=5) as db:
                stream = db.api.get_trajectory(v1.GetTrajectoryRequest("office", agent="alice"))
                if kind is None:
                    self.assertEqual(["H0"] * body.count(b"H0"), [m.agent_id for m in stream])
                else:
                    with self.assertRaises(kind):
                        list(stream)

    def test_no_answer_ends_at_the_deadline(self):
        with socket.socket() as silent:
            silent.bind(("127.0.0.1", 0))
            silent.listen()
            place = f"http://127.0.0.1:{silent.getsockname()[1]}"
            with dsgdb.open(place, timeout=0.3) as db:
                with self.assertRaises(dsgdb.DeadlineExceeded):
                    db.maps()
                with self.assertRaises(dsgdb.DeadlineExceeded):
                    list(db.api.get_mesh(v1.GetMeshRequest("office"), timeout=0.3))
                session = dsgdb.Session(dsgdb.Map(db.api, v1.MapSpec("office")), patience=0.0)
                with self.assertRaises(dsgdb.DeadlineExceeded):
                    session.upsert_nodes([dsgdb.Node("O1", name="mine")])

    @contextlib.contextmanager
    def answering(self, answer):
        """The address of something that answers all requests with the same bytes."""
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))
            listener.listen()
            thread = threading.Thread(target=self.answer, args=(listener, answer), daemon=True)
            thread.start()
            yield f"http://127.0.0.1:{listener.getsockname()[1]}"
            listener.shutdown(socket.SHUT_RDWR)
            thread.join()

    @staticmethod
    def answer(listener, answer):
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            with client:
                client.recv(65536)
                client.sendall(answer)


if __name__ == "__main__":
    unittest.main()
