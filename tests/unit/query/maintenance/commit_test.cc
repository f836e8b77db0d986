// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/graph_store.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

class CommitCall : public testing::Test {
 protected:
  CommitCall() {
    MakeOffice(folder_.path());
    core_ = OpenCore(folder_.path());
  }

  // A delta that adds one pose of the robot.
  static v1::CommitRequest OnePose(const std::string& session, int64_t sequence, TimeNs at_ns) {
    GraphDelta delta;
    delta.map = kMap;
    delta.session_id = session;
    delta.sequence = sequence;
    delta.appends = {{NodeId('r', 1), {PoseAt(at_ns, 1, 2, 0)}}};
    v1::CommitRequest request;
    ToProto(delta, LayerTable(), request.mutable_delta());
    return request;
  }

  absl::StatusOr<v1::CommitResponse> Commit(const v1::CommitRequest& request) {
    v1::CommitResponse reply;
    const absl::Status status = core_->Commit(call_, request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
};

TEST_F(CommitCall, AppliesADeltaAndAnswersARepeatWithTheFirstAnswer) {
  const v1::CommitRequest request = OnePose("s", 1, 10 * kSecond);
  const auto first = Commit(request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->revision(), 2);
  EXPECT_FALSE(first->replayed());
  const auto again = Commit(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->revision(), 2);
  EXPECT_TRUE(again->replayed());
}

TEST_F(CommitCall, DoesNotBelieveAClientThatSaysThatItForgets) {
  core_.reset();
  auto store = GraphStore::Open(folder_.path(), {.quota_bytes = 1});
  ASSERT_TRUE(store.ok()) << store.status();
  core_ = query::MakeServiceCore(*std::move(store));
  v1::CommitRequest request = OnePose("s", 1, 10 * kSecond);
  for (int64_t i = 0; i < 5'000; ++i) {
    auto* const pose = request.mutable_delta()->mutable_appends(0)->add_poses();
    pose->CopyFrom(request.delta().appends(0).poses(0));
    pose->set_time_ns((11 + i) * kSecond);
  }
  // What forgets may go past the quota.
  request.mutable_delta()->set_is_forgetting(true);
  EXPECT_EQ(ReasonOf(Commit(request).status()), Reason::kQuotaExceeded);
}

TEST_F(CommitCall, GoesToTheMapThatIsInTheFolderAlsoAfterARestore) {
  const std::string map = folder_.path() + "/" + kMap;
  TempFolder elsewhere;
  const std::string copy = elsewhere.path() + "/copy";
  std::filesystem::copy(map, copy);
  ASSERT_TRUE(Commit(OnePose("s", 1, 10 * kSecond)).ok());
  std::filesystem::remove_all(map);
  std::filesystem::copy(copy, map);
  const auto again = Commit(OnePose("s", 1, 10 * kSecond));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->revision(), 2);
  // The restored map had not seen it, and what was acknowledged is in the folder.
  EXPECT_FALSE(again->replayed());
  core_.reset();
  const auto store = GraphStore::Open(folder_.path(), {});
  ASSERT_TRUE(store.ok()) << store.status();
  const auto reader = (*store)->OpenMap(kMap);
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ((*reader)->Head()->revision, 2);
}

// Upserts that name some fields of what is there.
class PatchCall : public CommitCall {
 protected:
  v1::Node* AddNode(const std::string& id) {
    v1::Node* const node = Delta()->add_nodes();
    node->set_id(id);
    return node;
  }

  v1::Edge* AddEdge(const std::string& source, const std::string& relation,
                    const std::string& target) {
    v1::Edge* const edge = Delta()->add_edges();
    edge->set_source(source);
    edge->set_relation(relation);
    edge->set_target(target);
    return edge;
  }

  v1::GraphDelta* Delta() { return request_.mutable_delta(); }

  absl::Status Send() {
    Delta()->set_map(kMap);
    Delta()->set_session_id("patches");
    Delta()->set_sequence(sequence_);
    const absl::Status status = Commit(request_).status();
    if (status.ok()) ++sequence_;
    request_.Clear();
    return status;
  }

  Node NodeNow(const std::string& id) {
    const auto store = GraphStore::Open(folder_.path(), {});
    return *(*(*(*store)->OpenMap(kMap))->Latest())->GetNode(*ParseNodeId(id));
  }

  std::optional<Edge> EdgeNow(const EdgeKey& key) {
    const auto store = GraphStore::Open(folder_.path(), {});
    return *(*(*(*store)->OpenMap(kMap))->Latest())->FindEdge(key);
  }

  v1::CommitRequest request_;
  int64_t sequence_ = 1;
};

TEST_F(PatchCall, LeavesFieldsAsTheyAreThatAreNotSet) {
  v1::Node* cup = AddNode("O1");
  cup->mutable_object()->set_mesh_instance_id(7);
  cup->mutable_object()->mutable_color()->set_red(200);
  (*cup->mutable_attributes())["brand"].set_text("Duralex");
  (*cup->mutable_attributes())["full"].set_flag(true);
  cup->set_valid_to_ns(99);
  ASSERT_EQ(Send(), absl::OkStatus());
  const Node before = NodeNow("O1");
  EXPECT_EQ(before.name, "cup");
  EXPECT_EQ(before.kind, kinds::kObject);
  EXPECT_FALSE(before.box_node.isEmpty());

  cup = AddNode("O1");
  cup->set_name("mug");
  cup->mutable_object()->mutable_size()->set_x(0.1);
  (*cup->mutable_attributes())["full"].set_flag(false);
  ASSERT_EQ(Send(), absl::OkStatus());
  const Node after = NodeNow("O1");
  EXPECT_EQ(after.name, "mug");
  EXPECT_EQ(after.layer, before.layer);
  EXPECT_EQ(after.map_T_node.position, before.map_T_node.position);
  EXPECT_TRUE(after.box_node.isApprox(before.box_node));
  EXPECT_EQ(after.valid.to_ns, 99);
  ASSERT_TRUE(after.object.has_value());
  EXPECT_EQ(after.object->mesh_instance_id, 7u);
  EXPECT_EQ(after.object->size.x(), 0.1);
  ASSERT_TRUE(after.object->color.has_value());
  EXPECT_EQ((*after.object->color)[0], 200);
  EXPECT_EQ(after.attributes, (Attributes{{"brand", std::string("Duralex")}, {"full", false}}));
}

TEST_F(PatchCall, TakesAPoseWholeAlsoWhereItIsZero) {
  AddNode("O2")->mutable_map_t_node()->mutable_position()->set_x(14.5);
  // Outside of its place p3 (y 4 to 6) unless y stayed what it was.
  EXPECT_EQ(ReasonOf(Send()), Reason::kDeltaInvalid);
  v1::Node* chair = AddNode("O2");
  chair->mutable_map_t_node()->mutable_position()->set_x(14.6);
  chair->mutable_map_t_node()->mutable_position()->set_y(5);
  chair->mutable_map_t_node()->mutable_position()->set_z(0.5);
  ASSERT_EQ(Send(), absl::OkStatus());
  EXPECT_EQ(NodeNow("O2").map_T_node.position, Eigen::Vector3d(14.6, 5, 0.5));
  EXPECT_EQ(NodeNow("O2").name, "chair");
}

TEST_F(PatchCall, WritesWhatTheMaskNamesAlsoToClearIt) {
  v1::Node* cup = AddNode("O1");
  cup->set_valid_to_ns(99);
  cup->set_confidence(0.5);
  (*cup->mutable_attributes())["brand"].set_text("Duralex");
  ASSERT_EQ(Send(), absl::OkStatus());
  cup = AddNode("O1");
  cup->set_name("not in the mask");
  for (const char* path : {"valid_to_ns", "attributes", "confidence"}) {
    cup->mutable_update_mask()->add_paths(path);
  }
  ASSERT_EQ(Send(), absl::OkStatus());
  const Node node = NodeNow("O1");
  EXPECT_EQ(node.name, "cup");
  EXPECT_EQ(node.valid.to_ns, kTimeMax);
  EXPECT_FALSE(node.confidence.has_value());
  EXPECT_TRUE(node.attributes.empty());
}

TEST_F(PatchCall, ReplacesANodeWholeByAStar) {
  v1::Node* room = AddNode("R2");
  room->set_layer("rooms");
  room->set_kind(kinds::kRoom);
  room->mutable_map_t_node()->mutable_position()->set_x(15);
  room->mutable_bounding_box()->mutable_min()->set_x(-5);
  room->mutable_bounding_box()->mutable_max()->set_x(5);
  room->mutable_bounding_box()->mutable_max()->set_y(10);
  room->mutable_bounding_box()->mutable_max()->set_z(3);
  room->mutable_update_mask()->add_paths("*");
  ASSERT_EQ(Send(), absl::OkStatus());
  EXPECT_EQ(NodeNow("R2").name, "");
}

TEST_F(PatchCall, RefusesAPathThatIsNoField) {
  for (const char* path : {"colour", "attributes.brand", "object.model.x", "", "*.name"}) {
    AddNode("O1")->mutable_update_mask()->add_paths(path);
    const absl::Status status = Send();
    EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << path;
    EXPECT_EQ(MetadataOf(status)["value"], path);
  }
}

TEST_F(PatchCall, OfEdgesLeaveTheWeightAlone) {
  const EdgeKey key{NodeId('p', 1), relations::kTraversable, NodeId('p', 2)};
  const double weight = EdgeNow(key)->weight;
  EXPECT_NE(weight, 0.0);
  (*AddEdge("p1", key.relation, "p2")->mutable_attributes())["door"].set_flag(true);
  ASSERT_EQ(Send(), absl::OkStatus());
  EXPECT_EQ(EdgeNow(key)->weight, weight);
  EXPECT_EQ(EdgeNow(key)->attributes.size(), 1u);
  AddEdge("p1", key.relation, "p2")->mutable_update_mask()->add_paths("weight");
  ASSERT_EQ(Send(), absl::OkStatus());
  EXPECT_EQ(EdgeNow(key)->weight, 0.0);
  EXPECT_EQ(EdgeNow(key)->attributes.size(), 1u);
}

TEST_F(PatchCall, OfOneDeltaFollowEachOtherAndMakeWhatIsNotThere) {
  v1::Node* lamp = AddNode("O9");
  lamp->set_layer("objects");
  lamp->set_kind(kinds::kObject);
  lamp->set_name("lamp");
  AddNode("O9")->mutable_map_t_node()->mutable_position()->set_x(3);
  ASSERT_EQ(Send(), absl::OkStatus());
  EXPECT_EQ(NodeNow("O9").name, "lamp");
  EXPECT_EQ(NodeNow("O9").map_T_node.position.x(), 3.0);
  AddNode("O10")->set_name("without a layer");
  EXPECT_EQ(ReasonOf(Send()), Reason::kLayerUnknown);
}

TEST_F(CommitCall, IsSeenByTheNextQuestion) {
  ASSERT_TRUE(Commit(OnePose("s", 1, 10 * kSecond)).ok());
  v1::LocateAgentRequest question;
  question.set_map(kMap);
  question.set_agent("spot");
  question.set_at_ns(10 * kSecond);
  v1::LocateAgentResponse reply;
  const absl::Status status = core_->LocateAgent(call_, question, &reply);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(reply.header().read_revision(), 2);
  EXPECT_EQ(reply.pose().position().y(), 2.0);
}

TEST_F(CommitCall, TellsHowFarASessionGot) {
  ASSERT_TRUE(Commit(OnePose("s", 1, 10 * kSecond)).ok());
  ASSERT_TRUE(Commit(OnePose("s", 2, 11 * kSecond)).ok());
  v1::GetSessionRequest request;
  request.set_map(kMap);
  request.set_session_id("s");
  v1::GetSessionResponse reply;
  ASSERT_TRUE(core_->GetSession(call_, request, &reply).ok());
  EXPECT_EQ(reply.last_sequence(), 2);
  EXPECT_EQ(reply.last_revision(), 3);
  request.set_session_id("unknown");
  ASSERT_TRUE(core_->GetSession(call_, request, &reply).ok());
  EXPECT_EQ(reply.last_sequence(), 0);
  request.clear_session_id();
  EXPECT_EQ(ReasonOf(core_->GetSession(call_, request, &reply)), Reason::kFieldInvalid);
}

TEST_F(CommitCall, RefusesDeltasWithoutIdentityOrOrder) {
  EXPECT_EQ(ReasonOf(Commit(OnePose("", 1, 10 * kSecond)).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(Commit(OnePose("s", 0, 10 * kSecond)).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(Commit(OnePose("s", 5, 10 * kSecond)).status()), Reason::kSequenceGap);
  v1::CommitRequest request = OnePose("s", 1, 10 * kSecond);
  request.mutable_delta()->set_parent_revision(0);
  EXPECT_EQ(ReasonOf(Commit(request).status()), Reason::kParentRevisionStale);
  request.mutable_delta()->set_map("../x");
  EXPECT_EQ(ReasonOf(Commit(request).status()), Reason::kMapNameInvalid);
}

TEST_F(CommitCall, IsRefusedWhileAnotherWriterHoldsTheMapAndWorksOnceItIsGone) {
  {
    const auto store = GraphStore::Open(folder_.path(), {});
    ASSERT_TRUE(store.ok()) << store.status();
    const auto writer = (*store)->OpenWriter(kMap);
    ASSERT_TRUE(writer.ok()) << writer.status();
    EXPECT_EQ(ReasonOf(Commit(OnePose("s", 1, 10 * kSecond)).status()), Reason::kWriterLocked);
  }
  EXPECT_TRUE(Commit(OnePose("s", 1, 10 * kSecond)).ok());
}

TEST_F(CommitCall, TakesCommitsOfManyThreadsOneAfterTheOther) {
  std::vector<std::thread> threads;
  std::vector<absl::Status> statuses(4);
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      for (int64_t sequence = 1; sequence <= 5; ++sequence) {
        v1::CommitRequest request;
        request.mutable_delta()->set_map(kMap);
        request.mutable_delta()->set_session_id("thread" + std::to_string(i));
        request.mutable_delta()->set_sequence(sequence);
        v1::SemanticLabel* label = request.mutable_delta()->add_labels();
        label->set_id(100 * i + static_cast<int>(sequence));
        label->set_name("label");
        v1::CommitResponse reply;
        const absl::Status status = core_->Commit(query::CallContext(), request, &reply);
        if (!status.ok()) statuses[static_cast<size_t>(i)] = status;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const absl::Status& status : statuses) EXPECT_TRUE(status.ok()) << status;
  v1::GetSessionRequest request;
  request.set_map(kMap);
  request.set_session_id("thread3");
  v1::GetSessionResponse reply;
  ASSERT_TRUE(core_->GetSession(call_, request, &reply).ok());
  EXPECT_EQ(reply.last_sequence(), 5);
}

}  // namespace
}  // namespace dsg::test
