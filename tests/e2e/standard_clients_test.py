#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What any gRPC client may ask of a dsg-server: the health of its services, its protos, details of
errors. Asked by Debian's gRPC for Python, which gets bytes and knows nothing of this project."""

import subprocess
import unittest

import support

# Prints what the calls answer, one a line: CODE BYTES, as a Python literal.
CLIENT = r"""
import sys
import grpc

def ask(path, request, stream=False):
    try:
        if stream:
            reply = next(channel.stream_stream(path)(iter([request]), timeout=60))
        else:
            reply = channel.unary_unary(path)(request, timeout=60)
        print("OK", reply)
    except grpc.RpcError as error:
        trailers = dict(error.trailing_metadata())
        print(error.code().name, trailers.get("grpc-status-details-bin", b""))

def text(field, value):
    return bytes([field << 3 | 2, len(value)]) + value.encode()

channel = grpc.insecure_channel(sys.argv[1])
for service in ("", "dsg.v1.QueryService", "dsg.v1.NoService"):
    ask("/grpc.health.v1.Health/Check", text(1, service))
ask("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", text(7, "*"), stream=True)
ask("/dsg.v1.QueryService/GetNode", text(1, "nowhere"))
"""
SERVING = "OK " + repr(b"\x08\x01")
SERVICES = ("dsg.v1.QueryService", "dsg.v1.MapService", "dsg.v1.IngestService",
            "dsg.v1.MaintenanceService", "grpc.health.v1.Health")


class StandardClients(support.ProgramsTest):
    def ask(self, *options, listen="unix:s.sock"):
        """The lines of the client."""
        with self.server("store", listen, *options):
            done = subprocess.run([support.python_with_grpc(), "-c", CLIENT, listen],
                                  cwd=self.folder, capture_output=True, text=True, check=False,
                                  timeout=support.TIMEOUT_S)
        self.assertEqual("", done.stderr)
        return done.stdout.splitlines()

    def test_health_reflection_and_details_need_no_protos(self):
        whole, query, unknown, protos, error = self.ask()
        self.assertEqual([SERVING, SERVING], [whole, query])
        self.assertTrue(unknown.startswith("NOT_FOUND "), unknown)
        for service in SERVICES:
            self.assertIn(service, protos)
        self.assertTrue(error.startswith("NOT_FOUND "), error)
        for part in ("type.googleapis.com/dsg.v1.ErrorDetail", "MAP_UNKNOWN", "dsgdb",
                     "type.googleapis.com/google.rpc.ErrorInfo", "nowhere"):
            self.assertIn(part, error)

    def test_reflection_can_be_refused(self):
        self.assertTrue(self.ask("--reflection", "off")[3].startswith("UNIMPLEMENTED "))
        self.assertIn(SERVICES[0], self.ask("--reflection", "on")[3])


if __name__ == "__main__":
    unittest.main()
