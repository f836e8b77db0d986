// SPDX-License-Identifier: Apache-2.0
// Calls of every service over a real socket, and their errors as the client sees them.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "dsg/v1/errors.pb.h"
#include "dsg/v1/ingest_service.grpc.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.grpc.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "schema/codec/status_decode.h"
#include "server/server.h"
#include "server/status_mapping.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using test::kMap;
using test::kSecond;

class Rpc : public testing::Test {
 protected:
  Rpc() {
    test::MakeOffice(folder_.path());
    ServerOptions options;
    options.listen = "unix:" + folder_.path() + "/server.sock";
    auto server = Server::Start(test::OpenCore(folder_.path()), options);
    EXPECT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
    query_ = v1::QueryService::NewStub(channel_);
    maps_ = v1::MapService::NewStub(channel_);
    ingest_ = v1::IngestService::NewStub(channel_);
  }

  static v1::LocateAgentRequest Where(const std::string& agent, TimeNs at_ns) {
    v1::LocateAgentRequest request;
    request.set_map(kMap);
    request.set_agent(agent);
    request.set_at_ns(at_ns);
    return request;
  }

  // A call by path, without a stub; returns the bytes of the reply.
  grpc::Status CallByPath(const std::string& path, std::string* reply_bytes) {
    grpc::GenericStub stub(channel_);
    grpc::CompletionQueue queue;
    grpc::ClientContext context;
    const grpc::Slice no_fields;
    const grpc::ByteBuffer request(&no_fields, 1);
    const auto call = stub.PrepareUnaryCall(&context, path, request, &queue);
    call->StartCall();
    grpc::ByteBuffer reply;
    grpc::Status status;
    call->Finish(&reply, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    if (grpc::Slice slice; reply.Valid() && reply.DumpToSingleSlice(&slice).ok()) {
      reply_bytes->assign(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
    return status;
  }

  test::TempFolder folder_;
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::QueryService::Stub> query_;
  std::unique_ptr<v1::MapService::Stub> maps_;
  std::unique_ptr<v1::IngestService::Stub> ingest_;
};

TEST_F(Rpc, LocatesOneAgentAndMany) {
  grpc::ClientContext context;
  v1::LocateAgentResponse reply;
  const grpc::Status status = query_->LocateAgent(&context, Where("12", 3 * kSecond / 2), &reply);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_NEAR(reply.pose().position().x(), 2.5, 1e-12);
  EXPECT_EQ(reply.room_id(), "R1");

  grpc::ClientContext batch_context;
  v1::BatchLocateAgentsRequest batch;
  batch.set_map(kMap);
  for (const char* agent : {"12", "99"}) {
    v1::AgentInstant* instant = batch.add_instants();
    instant->set_agent(agent);
    instant->set_at_ns(0);
  }
  v1::BatchLocateAgentsResponse results;
  ASSERT_TRUE(query_->BatchLocateAgents(&batch_context, batch, &results).ok());
  ASSERT_EQ(results.results_size(), 2);
  EXPECT_EQ(results.results(0).status_code(), 0);
  EXPECT_EQ(results.results(1).status_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(Rpc, StreamsATrajectory) {
  grpc::ClientContext context;
  v1::GetTrajectoryRequest request;
  request.set_map(kMap);
  request.set_agent("12");
  request.set_resample_period_ns(1'000'000);
  const auto reader = query_->GetTrajectory(&context, request);
  v1::GetTrajectoryResponse message;
  int pose_count = 0;
  int message_count = 0;
  while (reader->Read(&message)) {
    EXPECT_EQ(message.has_header(), message_count == 0);
    pose_count += message.poses_size();
    ++message_count;
  }
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(pose_count, 18'001 + 2'001);
  EXPECT_EQ(message_count, 21);
}

TEST_F(Rpc, StreamsTheMesh) {
  // More than one message: a sheet of 40,000 vertices in one block.
  grpc::ClientContext commit_context;
  v1::CommitRequest commit;
  commit.mutable_delta()->set_map(kMap);
  commit.mutable_delta()->set_session_id("mesh");
  commit.mutable_delta()->set_sequence(1);
  v1::MeshBlock* block = commit.mutable_delta()->add_mesh_blocks();
  for (int i = 0; i < 40'000; ++i) {
    for (const float value :
         {0.01f * static_cast<float>(i % 200), 1e-5f * static_cast<float>(i), 0.f}) {
      block->add_positions(value);
    }
    block->add_last_seen_ns(1'000'000'000'000'000'000 + i);
  }
  for (const uint32_t vertex : {0u, 1u, 39'999u}) block->add_faces(vertex);
  v1::CommitResponse committed;
  const grpc::Status status = ingest_->Commit(&commit_context, commit, &committed);
  ASSERT_TRUE(status.ok()) << status.error_message();

  grpc::ClientContext context;
  v1::GetMeshRequest request;
  request.set_map(kMap);
  const auto reader = query_->GetMesh(&context, request);
  v1::GetMeshResponse message;
  int message_count = 0;
  int vertex_count = 0;
  int face_count = 0;
  while (reader->Read(&message)) {
    EXPECT_EQ(message.has_header(), message_count++ == 0);
    for (const v1::MeshBlock& piece : message.blocks()) {
      vertex_count += piece.positions_size() / 3;
      face_count += piece.faces_size() / 3;
    }
  }
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(vertex_count, 40'000);
  EXPECT_EQ(face_count, 1);
  EXPECT_GE(message_count, 1);
}

TEST_F(Rpc, StreamsBodyShapes) {
  grpc::ClientContext commit_context;
  v1::CommitRequest commit;
  commit.mutable_delta()->set_map(kMap);
  commit.mutable_delta()->set_session_id("bodies");
  commit.mutable_delta()->set_sequence(1);
  v1::ShapeAppend* append = commit.mutable_delta()->add_shapes();
  append->set_agent("H12");
  for (int i = 0; i < 20; ++i) {
    v1::BodyShape* body = append->add_shapes();
    body->set_time_ns(i * kSecond / 2);
    for (int j = 0; j < 30'000; ++j) body->add_vertices(0.5f);
    for (int j = 0; j < 72; ++j) body->add_joints(0.25f);
  }
  v1::CommitResponse committed;
  const grpc::Status status = ingest_->Commit(&commit_context, commit, &committed);
  ASSERT_TRUE(status.ok()) << status.error_message();

  grpc::ClientContext context;
  v1::GetAgentShapeRequest request;
  request.set_map(kMap);
  request.set_agent("12");
  const auto reader = query_->GetAgentShape(&context, request);
  v1::GetAgentShapeResponse message;
  int message_count = 0;
  std::vector<TimeNs> times;
  while (reader->Read(&message)) {
    EXPECT_EQ(message.has_header(), message_count++ == 0);
    for (const v1::AgentShape& body : message.shapes()) {
      times.push_back(body.shape().time_ns());
      EXPECT_EQ(body.shape().vertices_size(), 30'000);
      EXPECT_TRUE(body.has_pose());
    }
  }
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_GE(message_count, 2);
  EXPECT_EQ(times.size(), 20u);
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));

  grpc::ClientContext unknown_context;
  request.set_agent("nobody");
  const auto unknown = query_->GetAgentShape(&unknown_context, request);
  EXPECT_FALSE(unknown->Read(&message));
  EXPECT_EQ(unknown->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(Rpc, AnswersPresenceNodesEdgesAndNearest) {
  grpc::ClientContext presence_context;
  v1::ListPresenceRequest presence;
  presence.set_map(kMap);
  presence.set_node_id("R1");
  presence.set_to_ns(20 * kSecond);
  v1::ListPresenceResponse intervals;
  ASSERT_TRUE(query_->ListPresence(&presence_context, presence, &intervals).ok());
  EXPECT_EQ(intervals.intervals_size(), 2);

  grpc::ClientContext node_context;
  v1::GetNodeRequest get;
  get.set_map(kMap);
  get.set_id("R1");
  v1::GetNodeResponse node;
  ASSERT_TRUE(query_->GetNode(&node_context, get, &node).ok());
  EXPECT_EQ(node.node().name(), "kitchen");

  grpc::ClientContext nodes_context;
  v1::ListNodesRequest list;
  list.set_map(kMap);
  v1::ListNodesResponse nodes;
  ASSERT_TRUE(query_->ListNodes(&nodes_context, list, &nodes).ok());
  EXPECT_EQ(nodes.nodes_size(), 11);

  grpc::ClientContext edges_context;
  v1::ListEdgesRequest list_edges;
  list_edges.set_map(kMap);
  v1::ListEdgesResponse edges;
  ASSERT_TRUE(query_->ListEdges(&edges_context, list_edges, &edges).ok());
  EXPECT_EQ(edges.edges_size(), 9);

  grpc::ClientContext nearest_context;
  v1::ListNearestNodesRequest near;
  near.set_map(kMap);
  near.mutable_position()->set_x(14);
  near.mutable_filter()->set_kind("object");
  v1::ListNearestNodesResponse nearest;
  ASSERT_TRUE(query_->ListNearestNodes(&nearest_context, near, &nearest).ok());
  ASSERT_EQ(nearest.nodes_size(), 1);
  EXPECT_EQ(nearest.nodes(0).node().id(), "O2");
}

TEST_F(Rpc, AnswersForMapsAsAWhole) {
  grpc::ClientContext create_context;
  v1::CreateMapRequest create;
  create.mutable_map()->set_name("attic");
  v1::CreateMapResponse created;
  ASSERT_TRUE(maps_->CreateMap(&create_context, create, &created).ok());
  EXPECT_EQ(created.map().name(), "attic");

  grpc::ClientContext list_context;
  v1::ListMapsResponse list;
  ASSERT_TRUE(maps_->ListMaps(&list_context, {}, &list).ok());
  EXPECT_EQ(list.maps_size(), 2);

  grpc::ClientContext stats_context;
  v1::GetMapStatsRequest get_stats;
  get_stats.set_map(kMap);
  v1::GetMapStatsResponse stats;
  ASSERT_TRUE(maps_->GetMapStats(&stats_context, get_stats, &stats).ok());
  EXPECT_EQ(stats.node_count(), 11);

  grpc::ClientContext revisions_context;
  v1::ListRevisionsRequest list_revisions;
  list_revisions.set_map(kMap);
  v1::ListRevisionsResponse revisions;
  ASSERT_TRUE(maps_->ListRevisions(&revisions_context, list_revisions, &revisions).ok());
  ASSERT_EQ(revisions.revisions_size(), 1);
  EXPECT_EQ(revisions.revisions(0).message(), "an office");

  grpc::ClientContext info_context;
  v1::GetServerInfoResponse info;
  ASSERT_TRUE(maps_->GetServerInfo(&info_context, {}, &info).ok());
  EXPECT_FALSE(info.version().empty());
}

TEST_F(Rpc, CommitsADeltaAndTellsTheSession) {
  grpc::ClientContext commit_context;
  v1::CommitRequest commit;
  commit.mutable_delta()->set_map(kMap);
  commit.mutable_delta()->set_session_id("s");
  commit.mutable_delta()->set_sequence(1);
  v1::SemanticLabel* label = commit.mutable_delta()->add_labels();
  label->set_id(7);
  label->set_name("mug");
  v1::CommitResponse committed;
  const grpc::Status status = ingest_->Commit(&commit_context, commit, &committed);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(committed.revision(), 2);

  grpc::ClientContext session_context;
  v1::GetSessionRequest get_session;
  get_session.set_map(kMap);
  get_session.set_session_id("s");
  v1::GetSessionResponse session;
  ASSERT_TRUE(ingest_->GetSession(&session_context, get_session, &session).ok());
  EXPECT_EQ(session.last_sequence(), 1);
}

TEST_F(Rpc, CarriesTheReasonAndItsFactsInTheTrailer) {
  grpc::ClientContext context;
  v1::LocateAgentResponse reply;
  const grpc::Status status = query_->LocateAgent(&context, Where("12", 999 * kSecond), &reply);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  const v1::ErrorDetail detail = DetailOf(context);
  EXPECT_EQ(detail.reason(), v1::TIME_OUTSIDE_TRACK);
  EXPECT_EQ(detail.domain(), "dsg");
  EXPECT_EQ(detail.metadata().at("last_ns"), "62000000000");
  google::rpc::Status details;
  ASSERT_TRUE(details.ParseFromString(status.error_details()));
  ASSERT_EQ(details.details_size(), 2);
  google::rpc::ErrorInfo info;
  ASSERT_TRUE(details.details(1).UnpackTo(&info));
  EXPECT_EQ(info.reason(), "TIME_OUTSIDE_TRACK");
  EXPECT_EQ(info.domain(), "dsgdb");
  EXPECT_EQ(info.metadata().at("last_ns"), "62000000000");
}

TEST_F(Rpc, CarriesTheLongestErrorsWhole) {
  // Every character of the name is sent as three, and the name is in message and metadata.
  grpc::ClientContext context;
  v1::LocateAgentRequest request = Where("12", 0);
  request.set_map(std::string(4000, '%'));
  v1::LocateAgentResponse reply;
  const grpc::Status status = query_->LocateAgent(&context, request, &reply);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
  EXPECT_EQ(DetailOf(context).reason(), v1::MAP_NAME_INVALID);
  google::rpc::Status details;
  ASSERT_TRUE(details.ParseFromString(status.error_details()));
  EXPECT_GE(details.details_size(), 2);
}

TEST_F(Rpc, CarriesTheReasonOfAStreamThatFails) {
  grpc::ClientContext context;
  v1::GetTrajectoryRequest request;
  request.set_map(kMap);
  request.set_agent("99");
  const auto reader = query_->GetTrajectory(&context, request);
  v1::GetTrajectoryResponse message;
  EXPECT_FALSE(reader->Read(&message));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(context.GetServerTrailingMetadata().count(kErrorTrailer), 1u);
}

TEST_F(Rpc, TellsNobodyWhereTheStoreLies) {
  std::filesystem::create_directory(folder_.path() + "/cellar");
  std::ofstream(folder_.path() + "/cellar/graph.db") << "no database";
  for (const std::string map : {"attic", "cellar"}) {
    grpc::ClientContext context;
    v1::LocateAgentRequest request = Where("12", 0);
    request.set_map(map);
    v1::LocateAgentResponse reply;
    const grpc::Status status = query_->LocateAgent(&context, request, &reply);
    EXPECT_FALSE(status.ok());
    EXPECT_NE(status.error_message().find(map), std::string::npos) << status.error_message();
    EXPECT_EQ(status.error_message().find(folder_.path()), std::string::npos)
        << status.error_message();
    for (const auto& [key, value] : context.GetServerTrailingMetadata()) {
      EXPECT_EQ(std::string(value.data(), value.size()).find(folder_.path()), std::string::npos);
    }
  }
}

TEST_F(Rpc, AnswersAHugeNameWithAShortError) {
  grpc::ClientContext context;
  v1::LocateAgentResponse reply;
  const grpc::Status status =
      query_->LocateAgent(&context, Where(std::string(3'000'000, 'x'), 0), &reply);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_LE(status.error_message().size(), kMessageBytesMax);
}

TEST_F(Rpc, RefusesGzip) {
  grpc::ClientContext context;
  context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  v1::LocateAgentResponse reply;
  EXPECT_EQ(query_->LocateAgent(&context, Where(std::string(5000, 'x'), 0), &reply).error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(Rpc, RefusesMessagesOfMoreThanFourMebibytes) {
  grpc::ClientContext context;
  v1::LocateAgentResponse reply;
  EXPECT_EQ(query_->LocateAgent(&context, Where(std::string(5 << 20, 'x'), 0), &reply).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST_F(Rpc, ServesEveryMethodOfTheProtocol) {
  int method_count = 0;
  for (const auto* const file :
       {v1::LocateAgentRequest::descriptor()->file(), v1::ListMapsRequest::descriptor()->file(),
        v1::CommitRequest::descriptor()->file(), v1::PruneRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service_count(); ++i) {
      for (int k = 0; k < file->service(i)->method_count(); ++k, ++method_count) {
        const auto* const method = file->service(i)->method(k);
        std::string reply;
        const std::string path = "/" + file->service(i)->full_name() + "/" + method->name();
        EXPECT_NE(CallByPath(path, &reply).error_code(), grpc::StatusCode::UNIMPLEMENTED) << path;
      }
    }
  }
  EXPECT_GE(method_count, 37);
}

TEST_F(Rpc, HidesItsInsides) {
  std::string reply;
  EXPECT_EQ(CallByPath("/grpc.channelz.v1.Channelz/GetServers", &reply).error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(Rpc, SaysWhichMethodItDoesNotKnow) {
  std::string reply;
  for (const char* path : {"/dsg.v1.QueryService/GetNothing", "/dsg.v2.QueryService/GetNode"}) {
    const grpc::Status status = CallByPath(path, &reply);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
    EXPECT_NE(status.error_message().find(path), std::string::npos) << status.error_message();
  }
}

}  // namespace
}  // namespace dsg::server
