#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The examples of docs/examples, in C++ and Python, against a server on loopback."""

import os
import subprocess
import unittest

import support

EXAMPLES = os.path.join(support.ROOT, "docs", "examples")
PROTO = os.path.join(support.ROOT, "proto")
PLUGIN = "/usr/bin/grpc_python_plugin"


class Examples(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ingest("store", cls.simulate("office", people=4, seconds=60))

    def ask(self, command, address, agent, extra=None):
        environment = dict(support.environment(), **(extra or {}))
        return subprocess.run(command + [address, "office", agent, "20"], text=True,
                              capture_output=True, check=False, env=environment,
                              timeout=support.TIMEOUT_S)

    def expect_answers(self, done):
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        lines = done.stdout.splitlines()
        counts = {what: sum(line.startswith(what + ": ") for line in lines)
                  for what in ("where", "find", "path", "predict")}
        self.assertEqual(10, counts["where"], done.stdout)
        self.assertEqual(3, counts["find"], done.stdout)
        self.assertEqual(1, counts["path"], done.stdout)
        self.assertGreaterEqual(counts["predict"], 1, done.stdout)

    def test_the_cpp_client_answers(self):
        program = [os.path.join(support.BIN, "dsg-example-ask")]
        with self.server("store", "unix:" + self.path("cpp.sock")):
            address = "unix:" + self.path("cpp.sock")
            self.expect_answers(self.ask(program, address, "alice"))
            refused = self.ask(program, address, "nobody-of-that-name")
            self.assertIn("nobody-of-that-name", refused.stdout + refused.stderr)

    def test_python_answers_with_generated_stubs(self):
        stubs = self.path("stubs")
        os.makedirs(stubs)
        protos = [os.path.join(PROTO, "dsg", "v1", name)
                  for name in sorted(os.listdir(os.path.join(PROTO, "dsg", "v1")))
                  if name.endswith(".proto")]
        self.ok("protoc", "-I", PROTO, f"--python_out={stubs}", f"--grpc_out={stubs}",
                f"--plugin=protoc-gen-grpc={PLUGIN}", *protos)
        program = [support.python_with_grpc(), os.path.join(EXAMPLES, "ask.py")]
        with self.server("store", "unix:" + self.path("py.sock")):
            address = "unix:" + self.path("py.sock")
            self.expect_answers(self.ask(program, address, "alice", {"PYTHONPATH": stubs}))


if __name__ == "__main__":
    unittest.main()
