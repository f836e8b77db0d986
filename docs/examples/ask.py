#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An example in Python: connects to a dsg-server and runs four queries about one agent.

    ask.py ADDRESS MAP AGENT SECONDS        e.g. ask.py unix:dsg.sock office carol 30

Needs python3-grpcio and python3-protobuf, and stubs generated from the .proto files once:

    protoc -I proto --python_out=stubs --grpc_out=stubs \\
      --plugin=protoc-gen-grpc=/usr/bin/grpc_python_plugin proto/dsg/v1/*.proto
    PYTHONPATH=stubs python3 docs/examples/ask.py unix:dsg.sock office carol 30

Always give a deadline (timeout=): without one gRPC waits for ever.
Use the batch calls instead of loops: one round trip instead of many.
"""

import sys

import grpc

from dsg.v1 import query_service_pb2 as query
from dsg.v1 import query_service_pb2_grpc
from dsg.v1 import search_pb2 as search
from dsg.v1 import space_pb2 as space

TIMEOUT_S = 5.0
NS_PER_S = 1_000_000_000


def ask_where(service, name, agent, at_ns):
    """Each second for ten seconds, in one call."""
    instants = [query.AgentInstant(agent=agent, at_ns=at_ns + i * NS_PER_S) for i in range(10)]
    reply = service.BatchLocateAgents(
        query.BatchLocateAgentsRequest(map=name, instants=instants), timeout=TIMEOUT_S)
    for result in reply.results:
        if result.status_code:
            print(f"where: {result.status_message}")
            continue
        p = result.pose.position
        print(f"where: {result.agent_id} in {result.room_id} at {p.x:.2f} {p.y:.2f}")


def ask_find(service, name):
    """The query language of docs/search.md, nearest first from the origin."""
    request = search.SearchNodesRequest(map=name, query="chair", page_size=3)
    request.near.SetInParent()
    for hit in service.SearchNodes(request, timeout=TIMEOUT_S).hits:
        print(f"find: {hit.node.id} {hit.node.name}, {hit.distance_m:.2f} m")


def ask_path(service, name, agent, at_ns):
    """The path from the agent to the nearest chair."""
    request = space.PlanPathRequest(map=name, at_ns=at_ns)
    # "from" is a keyword of Python.
    getattr(request, "from").node = agent
    request.to.nearest.class_name = "chair"
    reply = service.PlanPath(request, timeout=TIMEOUT_S)
    print(f"path: {reply.length_m:.2f} m to {reply.to_node_id} over "
          f"{len(reply.place_ids)} places")


def ask_predict(service, name, agent, from_ns):
    request = space.PredictAgentRequest(map=name, agent=agent, from_ns=from_ns)
    for path in service.PredictAgent(request, timeout=TIMEOUT_S).paths:
        print(f"predict: probability {path.probability:.3f}, {len(path.poses)} steps")


def main(arguments):
    if len(arguments) != 4:
        print("usage: ask.py ADDRESS MAP AGENT SECONDS", file=sys.stderr)
        return 2
    address, name, agent, seconds = arguments
    at_ns = int(float(seconds) * NS_PER_S)
    with grpc.insecure_channel(address) as channel:
        service = query_service_pb2_grpc.QueryServiceStub(channel)
        try:
            ask_where(service, name, agent, at_ns)
            ask_find(service, name)
            ask_path(service, name, agent, at_ns)
            ask_predict(service, name, agent, at_ns)
        except grpc.RpcError as error:
            print(f"ask.py: {error.code().name}: {error.details()}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
