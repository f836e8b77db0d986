#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Who may call a server: tokens of dsg and dsg-ingest, users of a unix socket, HTTP, and a file
that changes while the server runs."""

import contextlib
import json
import os
import re
import signal
import ssl
import unittest

import http_port
import support


class Access(http_port.HttpTest):
    # More for dsg-ingest.
    TLS = ()

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.tokens = {name: cls.new_token(name) for name in ("asker", "robot", "stranger")}
        cls.write_access(cls.callers())

    @classmethod
    def new_token(cls, name):
        """Makes a token as docs/access.md says: a file of the caller, and a line for the server."""
        done = support.run("dsg-server", "--new-token")
        token = done.stdout.strip()
        line = re.search(r"token_sha256: [0-9a-f]{64}", done.stderr).group()
        path = cls.path(name + ".token")
        with open(path, "w", encoding="utf-8") as file:
            file.write(token + "\n")
        os.chmod(path, 0o600)
        return {"token": token, "line": line, "path": path}

    @classmethod
    def callers(cls):
        return ("callers:\n"
                f"  - name: asker\n    {cls.tokens['asker']['line']}\n    role: reader\n"
                f"  - name: robot\n    {cls.tokens['robot']['line']}\n    role: writer\n"
                "    maps: [\"robot-*\"]\n")

    @classmethod
    def write_access(cls, text):
        path = cls.path("access.yaml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(path, 0o600)
        return path

    @contextlib.contextmanager
    def served(self, *options, listen="unix:grpc.sock", access=True):
        """A server with the access file and an HTTP port. That it is ready tells its log: nobody
        may ask it without a token."""
        with open(self.path("server.log"), "w", encoding="utf-8") as log:
            process = support.start("dsg-server", "--store", "store", "--listen", listen, "--http",
                                    "127.0.0.1:0", *(("--access", "access.yaml") if access else ()),
                                    *options, cwd=self.folder, log=log)
        try:
            self.wait_for_log("HTTP on")
            yield process, http_port.Port(self.in_log(r"HTTP on (\S+)"), self.folder)
            process.send_signal(signal.SIGTERM)
            self.assertEqual(0, process.wait(timeout=support.TIMEOUT_S))
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()

    def in_log(self, pattern):
        with open(self.path("server.log"), encoding="utf-8") as log:
            return re.search(pattern, log.read()).group(1)

    def grpc_address(self):
        return self.in_log(r"listening on (\S+),")

    def asked(self, name, *verb):
        """A verb of dsg on the server, as the caller of that name."""
        token = ["--token-file", self.tokens[name]["path"]] if name else []
        return support.run("dsg", *verb, "--server", self.grpc_address(), *token,
                           cwd=self.folder)

    def test_who_has_a_role_gets_answers_and_who_has_none_a_reason(self):
        with self.served(listen="127.0.0.1:0"):
            done = self.asked("asker", "stats", "--map", "office")
            self.assertEqual(0, done.returncode, done.stderr)
            done = self.asked("", "stats", "--map", "office")
            self.assertNotEqual(0, done.returncode)
            self.assertIn("does not know who calls", done.stderr)
            self.assertIn("--token-file", done.stderr)
            done = self.asked("stranger", "stats", "--map", "office")
            self.assertIn("the token is not known", done.stderr)
            done = self.asked("asker", "drop", "office", "--yes")
            self.assertNotEqual(0, done.returncode)
            self.assertIn("needs the role admin", done.stderr)
            # A map of others is one that does not exist.
            done = self.asked("robot", "stats", "--map", "office")
            self.assertIn("may see no map \"office\"", done.stderr)
            done = self.asked("robot", "maps", "--json")
            maps = json.loads(done.stdout)["maps"]
            self.assertNotIn("office", [one["name"] for one in maps], done.stderr)
        self.assertIn("office",
                      [one["name"] for one in self.ask("maps", "--store", "store")["maps"]])

    def test_a_robot_commits_to_maps_of_its_own(self):
        log = self.simulate("more", people=2, seconds=10)
        with self.served(listen="127.0.0.1:0"):
            token = ["--token-file", self.tokens["robot"]["path"]]
            server = ["--server", self.grpc_address(), *self.TLS]
            done = support.run("dsg-ingest", *server, *token, "--map", "robot-7", "--quiet", log,
                               cwd=self.folder)
            self.assertEqual(0, done.returncode, done.stderr)
            done = support.run("dsg-ingest", *server, *token, "--map", "office", "--quiet", log,
                               cwd=self.folder)
            self.assertNotEqual(0, done.returncode)
            self.assertIn("office", done.stderr)
            done = self.asked("robot", "prune", "--map", "robot-7", "--older-than", "1s", "--yes")
            self.assertNotEqual(0, done.returncode)

    def test_the_user_of_the_server_needs_no_token_on_its_socket(self):
        with self.served():
            self.ok("dsg", "stats", "--map", "office", "--server", "unix:grpc.sock")
            self.assertEqual(0o600, os.stat(self.path("grpc.sock")).st_mode & 0o777)
            # A token that is shown counts, though.
            self.refused(2, ["the token is not known"], "dsg", "stats", "--map", "office",
                         "--server", "unix:grpc.sock", "--token-file", "stranger.token")

    def test_http_asks_for_the_same_tokens(self):
        with self.served() as (_, port):
            self.assertEqual("", port.token)
            self.assertEqual(401, port.ask("MapService/ListMaps", {})[0])
            port.token = self.tokens["asker"]["token"]
            status, _, body = port.ask("MapService/ListMaps", {})
            self.assertEqual((200, "office"), (status, json.loads(body)["maps"][0]["name"]))
            status, _, body = port.ask("MaintenanceService/SetTag", {"map": "office", "name": "x"})
            self.assertEqual((403, "permission_denied"), (status, json.loads(body)["code"]))
            port.token = self.tokens["robot"]["token"]
            self.assertEqual(404, port.ask("QueryService/GetNode",
                                           {"map": "office", "id": "R0"})[0])
            port.token = "guess"
            status, reply, _ = port.ask("MapService/ListMaps", {})
            self.assertEqual((401, "Bearer"), (status, reply.headers["WWW-Authenticate"]))
            # The viewer's files hold no data; its calls show the token behind #token=.
            with contextlib.closing(port.connect()) as connection:
                connection.request("GET", "/")
                self.assertEqual(200, connection.getresponse().status)

    def test_the_file_is_read_again_and_a_wrong_one_is_not_taken(self):
        with self.served(listen="127.0.0.1:0") as (process, _):
            self.assertNotEqual(0, self.asked("stranger", "maps").returncode)
            self.write_access(self.callers() + "  - name: stranger\n    role: king\n")
            process.send_signal(signal.SIGHUP)
            self.wait_for_log("a file is not taken")
            self.assertEqual(0, self.asked("asker", "maps").returncode)
            self.write_access(self.callers() + "  - name: stranger\n    role: reader\n    " +
                              self.tokens["stranger"]["line"] + "\n")
            process.send_signal(signal.SIGHUP)
            self.wait_for_log("certificates again")
            self.assertEqual(0, self.asked("stranger", "maps").returncode)
        self.write_access(self.callers())

    def test_rights_that_are_taken_away_count_for_a_request_that_is_on_its_way(self):
        with self.served() as (process, port):
            port.token = self.tokens["asker"]["token"]
            port.ask("MapService/ListMaps", {})
            with contextlib.closing(port.connect()) as connection:
                connection.putrequest("POST", "/dsg.v1.MapService/ListMaps")
                for name, value in port.fields(connect_timeout_ms=60000).items():
                    connection.putheader(name, value)
                connection.putheader("Content-Length", "2")
                connection.endheaders()
                connection.send(b"{")
                self.write_access(self.callers().replace("asker", "renamed"))
                process.send_signal(signal.SIGHUP)
                self.wait_for_log("certificates again")
                connection.send(b"}")
                reply = connection.getresponse()
                self.assertEqual((401, True), (reply.status, b"call again" in reply.read()))
        self.write_access(self.callers())

    def test_a_token_does_not_leave_the_machine_in_the_clear(self):
        self.refused(2, ["--tls-ca"], "dsg", "version", "--server", "maps.example.org:4410",
                     "--token-file", "asker.token")

    def wait_for_log(self, words):
        def is_there():
            with open(self.path("server.log"), encoding="utf-8") as log:
                return words in log.read()
        support.wait_until(is_there, words)

    def test_the_audit_log_tells_who_changed_what_and_who_was_refused(self):
        key = self.path("audit.key")
        with open(key, "wb") as file:
            file.write(os.urandom(32))
        os.chmod(key, 0o600)
        log = self.simulate("audited", people=2, seconds=5)
        audit = ("--audit", "audit.jsonl", "--audit-key", "audit.key")
        for name in ("robot-8", "robot-9"):
            with self.served(*audit, listen="127.0.0.1:0") as (_, port):
                self.assertEqual(401, port.ask("QueryService/GetNode", {})[0])
                done = support.run("dsg-ingest", "--server", self.grpc_address(), *self.TLS,
                                   "--token-file", "robot.token", "--map", name, "--quiet", log,
                                   cwd=self.folder)
                self.assertEqual(0, done.returncode, done.stderr)
                self.asked("asker", "stats", "--map", "office")
                self.asked("asker", "drop", "office", "--yes")
                self.asked("stranger", "maps")
        shown = self.ok("dsg", "audit", "audit.jsonl", "--key", "audit.key", "--json")
        lines = [json.loads(line) for line in shown.splitlines()]
        self.assertEqual(list(range(1, len(lines) + 1)), [line["number"] for line in lines])
        told = {(line["caller"], line["method"], line["map"], line["code"]) for line in lines}
        self.assertLessEqual({("robot", "CreateMap", "robot-8", "OK"),
                              ("robot", "Commit", "robot-9", "OK"),
                              ("asker", "DropMap", "", "PERMISSION_DENIED"),
                              ("", "ListMaps", "", "UNAUTHENTICATED"),
                              ("", "GetNode", "", "UNAUTHENTICATED")}, told)
        # Questions are in no log.
        self.assertNotIn("SearchNodes", {line["method"] for line in lines})
        commits = [line for line in lines if line["method"] == "Commit"]
        for begun, done in zip(commits[::2], commits[1::2]):
            self.assertEqual(("BEGUN", "OK"), (begun["code"], done["code"]))
            self.assertGreater(done["revision"], 0)
        table = self.ok("dsg", "audit", "audit.jsonl", "--key", "audit.key", "--caller", "asker")
        self.assertIn("PERMISSION_DENIED", table)
        chain = re.search(r"chain ([0-9a-f]{64})", table).group(1)
        self.ok("dsg", "audit", "audit.jsonl", "--key", "audit.key", "--noted", chain)
        self.refused(4, ["no line of the chain"], "dsg", "audit", "audit.jsonl", "--key",
                     "audit.key", "--noted", "0" * 64)
        with open(self.path("audit.jsonl"), encoding="utf-8") as file:
            text = file.read()
        with open(self.path("audit.jsonl"), "w", encoding="utf-8") as file:
            file.write(text.replace('"robot"', '"asker"', 1))
        self.refused(4, ["is not what was written"], "dsg", "audit", "audit.jsonl", "--key",
                     "audit.key")
        # A server adds nothing to it.
        done = support.run("dsg-server", "--store", "store", "--listen", "127.0.0.1:0", *audit,
                           cwd=self.folder)
        self.assertEqual(2, done.returncode, done.stderr)

    def test_secrets_are_not_taken_from_files_of_everybody_and_are_in_no_log(self):
        path = self.tokens["asker"]["path"]
        with self.served(listen="127.0.0.1:0"):
            os.chmod(path, 0o644)
            try:
                done = self.asked("asker", "maps")
            finally:
                os.chmod(path, 0o600)
            self.assertEqual(2, done.returncode, done.stderr)
            self.assertIn("chmod 600", done.stderr)
            self.asked("asker", "maps")
            self.asked("stranger", "maps")
        with open(self.path("server.log"), encoding="utf-8") as log:
            text = log.read()
        for name, made in self.tokens.items():
            self.assertNotIn(made["token"], text, name)

    def test_options_without_a_value_switch_nothing_off(self):
        for option in ("--access", "--audit", "--tls-cert", "--tls-client-ca"):
            with self.subTest(option=option):
                self.refused(2, ["empty"], "dsg-server", "--store", "store", "--listen",
                             "127.0.0.1:0", option, "")
        self.refused(2, ["--access"], "dsg-server", "--store", "store", "--socket-mode", "666")

    def test_a_server_with_a_wrong_file_does_not_start(self):
        path = self.path("wrong.yaml")
        with open(path, "w", encoding="utf-8") as file:
            file.write("callers:\n  - name: a\n    role: reader\n")
        os.chmod(path, 0o600)
        done = support.run("dsg-server", "--store", self.path("store"), "--listen",
                           "127.0.0.1:0", "--access", path)
        self.assertEqual(2, done.returncode, done.stderr)
        self.assertIn("wrong.yaml:2:", done.stderr)
        self.assertIn("nothing to show", done.stderr)


class Certificates:
    """A CA, and what it signs, by the openssl program."""

    def __init__(self, test):
        self.test = test
        self.make("ca", None, "basicConstraints=critical,CA:TRUE")

    def make(self, name, alternative, extension=""):
        """NAME.pem and NAME.key; of a server or client with that alternative name."""
        run = self.test.ok
        if alternative is None:
            run("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj", f"/CN={name}",
                "-keyout", name + ".key", "-out", name + ".pem", "-addext", extension)
        else:
            run("openssl", "req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
                "-nodes", "-subj", f"/CN={name}", "-keyout", name + ".key", "-out", name + ".csr")
            with open(self.test.path("extensions"), "w", encoding="utf-8") as file:
                file.write(f"subjectAltName={alternative}\n")
            run("openssl", "x509", "-req", "-in", name + ".csr", "-CA", "ca.pem", "-CAkey",
                "ca.key", "-CAcreateserial", "-days", "2", "-extfile", "extensions", "-out",
                name + ".pem")
        os.chmod(self.test.path(name + ".key"), 0o600)


class Encrypted(Access):
    """The same server behind TLS."""

    TLS = ("--tls-ca", "ca.pem")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        made = Certificates(cls)
        made.make("server", "DNS:localhost,IP:127.0.0.1")
        made.make("robot", "DNS:robot.example.org")
        made.make("nobody", "DNS:nobody.example.org")
        cls.certificates = made

    @classmethod
    def callers(cls):
        return super().callers() + ("  - name: certified\n    certificate: robot.example.org\n"
                                    "    role: reader\n")

    def served(self, *options, **more):
        return super().served(*options, "--tls-cert", "server.pem", "--tls-key", "server.key",
                              **more)

    def asked(self, name, *verb):
        return super().asked(name, *verb, "--tls-ca", "ca.pem")

    def test_a_certificate_says_who_calls(self):
        tls = ("--tls-client-ca", "ca.pem")
        with self.served(*tls, listen="127.0.0.1:0"):
            shown = ("stats", "--map", "office", "--server", self.grpc_address(), "--tls-ca",
                     "ca.pem")
            self.ok("dsg", *shown, "--tls-cert", "robot.pem", "--tls-key", "robot.key")
            self.refused(2, ["nobody.example.org"], "dsg", *shown, "--tls-cert", "nobody.pem",
                         "--tls-key", "nobody.key")
            # Without a certificate there is no connection.
            done = support.run("dsg", *shown, cwd=self.folder)
            self.assertNotEqual(0, done.returncode)

    def test_nothing_is_answered_that_is_not_encrypted(self):
        with self.served(listen="127.0.0.1:0") as (_, port):
            self.assertTrue(port.url.startswith("https://"), port.url)
            done = support.run("dsg", "version", "--server", self.grpc_address(), "--timeout", "3",
                               "--token-file", "asker.token", cwd=self.folder)
            self.assertNotEqual(0, done.returncode)
            answer = port.raw(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
            self.assertEqual(0, http_port.status_of(answer), answer)
            # One that is signed by others is not believed.
            self.ok("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                    "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj", "/CN=other",
                    "-keyout", "other.key", "-out", "other.pem")
            done = support.run("dsg", "version", "--server", self.grpc_address(), "--timeout", "3",
                               "--tls-ca", "other.pem", "--token-file", "asker.token",
                               cwd=self.folder)
            self.assertNotEqual(0, done.returncode)

    def test_a_new_certificate_is_taken_without_a_restart(self):
        with self.served(listen="127.0.0.1:0") as (process, port):
            before = ssl.get_server_certificate(port.address)
            self.certificates.make("server", "DNS:localhost,IP:127.0.0.1")
            process.send_signal(signal.SIGHUP)
            self.wait_for_log("certificates again")
            self.assertNotEqual(before, ssl.get_server_certificate(port.address))
            self.assertEqual(0, self.asked("asker", "maps").returncode)

    def test_other_machines_may_reach_it(self):
        with self.served(listen="0.0.0.0:0"):
            self.assertIn("0.0.0.0", self.grpc_address())
        done = support.run("dsg-server", "--store", "store", "--listen", "0.0.0.0:0", "--tls-cert",
                           "server.pem", "--tls-key", "server.key", cwd=self.folder)
        self.assertEqual(2, done.returncode)
        self.assertIn("--access", done.stderr)


if __name__ == "__main__":
    unittest.main()
