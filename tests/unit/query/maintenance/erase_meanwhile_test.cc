// SPDX-License-Identifier: Apache-2.0
// Erasing by policy while others write, and after an erasure that was cut off.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/erasure.h"
#include "schema/store/sqlite/map_file.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

using query::CallContext;

constexpr uint64_t kFirst = 7000;
constexpr int kCount = 6;

NodeId PlantedId(int i) { return NodeId('O', kFirst + static_cast<uint64_t>(i)); }
std::string SecretOf(int i) { return absl::StrCat("planted-secret-", 7919 * i); }

int SecretCount(const std::string& folder) {
  const std::string bytes = ReadFolder(folder);
  int count = 0;
  for (int i = 0; i < kCount; ++i) count += absl::StrContains(bytes, SecretOf(i)) ? 1 : 0;
  return count;
}

// The office, with things of secret names in R1 (even ones) and R2.
class EraseMeanwhileTest : public testing::Test {
 protected:
  EraseMeanwhileTest() {
    MakeOffice(folder_.path());
    GraphDelta delta;
    for (int i = 0; i < kCount; ++i) {
      delta.nodes.push_back(Thing(PlantedId(i), SecretOf(i)));
      Edge edge{NodeId('R', i % 2 == 0 ? 1 : 2), relations::kContains, PlantedId(i)};
      delta.edges.push_back(edge);
    }
    CommitToOffice(folder_.path(), delta);
    Open(folder_.path());
  }

  static Node Thing(NodeId id, const std::string& name) {
    const Eigen::Vector3d corner(id.index() % 2 == 0 ? 1 : 12, 2, 0);
    return MakeNode(id, layers::kObjects, kinds::kObject, name,
                    Box3d(corner, corner.array() + 0.1));
  }

  void Open(const std::string& folder) {
    core_.reset();
    core_ = OpenCore(folder);
  }

  static v1::PruneRequest EraseBranches(const std::vector<std::string>& branches) {
    v1::PruneRequest request;
    request.set_map(kMap);
    for (const std::string& branch : branches) {
      v1::PrunePolicy* const policy = request.add_policies();
      policy->set_branch(branch);
      policy->set_strength(v1::ERASE);
    }
    return request;
  }

  // Calls `meanwhile` after each message but the last, with the number of the message.
  absl::StatusOr<v1::PruneResponse> Prune(const v1::PruneRequest& request,
                                          const std::function<void(int)>& meanwhile = {}) {
    DSG_ASSIGN_OR_RETURN(const auto cursor, core_->Prune(call_, request));
    v1::PruneResponse all;
    double progress = 0.0;
    for (int count = 0; !cursor->done(); ++count) {
      if (count > 0 && meanwhile) meanwhile(count);
      v1::PruneResponse message;
      DSG_RETURN_IF_ERROR(cursor->Next(call_, &message).status());
      EXPECT_GE(message.progress(), progress);
      progress = message.progress();
      all.MergeFrom(message);
      if (count > 100) return absl::InternalError("it does not come to an end");
    }
    return all;
  }

  void Commit(GraphDelta delta) {
    delta.map = kMap;
    delta.session_id = "robot";
    delta.sequence = ++sequence_;
    v1::CommitRequest request;
    ToProto(delta, LayerTable(), request.mutable_delta());
    v1::CommitResponse reply;
    const absl::Status status = core_->Commit(CallContext(), request, &reply);
    EXPECT_TRUE(status.ok()) << status;
  }
  void CommitNode(const Node& node) {
    GraphDelta delta;
    delta.nodes = {node};
    Commit(delta);
  }
  // Of "12", between 2 s and 4 s.
  void CorrectTrack() {
    GraphDelta delta;
    delta.corrections = {{NodeId('H', 12),
                          2 * kSecond,
                          4 * kSecond,
                          {PoseAt(2 * kSecond, 3, 5 + 0.001 * static_cast<double>(sequence_), 1)}}};
    Commit(delta);
  }

  v1::GetMapStatsResponse Stats() {
    v1::GetMapStatsRequest request;
    request.set_map(kMap);
    v1::GetMapStatsResponse reply;
    EXPECT_TRUE(core_->GetMapStats(call_, request, &reply).ok());
    return reply;
  }

  bool Has(const std::string& id, Revision revision = 0) {
    v1::GetNodeRequest request;
    request.set_map(kMap);
    request.set_id(id);
    if (revision > 0) request.mutable_read_at()->set_exact_revision(revision);
    v1::GetNodeResponse reply;
    return core_->GetNode(call_, request, &reply).ok();
  }

  // Of any revision; what the store says, and that it is sound.
  int64_t PoseCountBefore(NodeId agent, TimeNs time_ns) {
    auto store = GraphStore::Open(folder_.path(), {});
    auto map = (*store)->OpenMap(kMap);
    int64_t count = 0;
    for (Revision revision = (*map)->Head()->revision; revision > 0; --revision) {
      const auto then = (*map)->At(revision);
      if (!then.ok()) break;
      const auto read = (*then)->ReadPoses(agent, kTimeMin, time_ns, {}, [&](const TimedPose&) {
        ++count;
        return true;
      });
      EXPECT_TRUE(read.ok() || ReasonOf(read) == Reason::kAgentUnknown) << read;
    }
    const auto report = (*map)->Verify({}, {});
    EXPECT_TRUE(report.ok() && report->problems.empty() && report->notes.empty());
    return count;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  CallContext call_;
  int64_t sequence_ = 0;
};

TEST_F(EraseMeanwhileTest, TheSameRequestDoesTheRestWhereverItWasCutOff) {
  ASSERT_TRUE(Prune([] {
                v1::PruneRequest request = EraseBranches({"R1", "R2"});
                for (auto& policy : *request.mutable_policies()) policy.set_strength(v1::RETIRE);
                return request;
              }())
                  .ok());
  core_.reset();
  const std::string base = folder_.path();
  EXPECT_EQ(SecretCount(base), kCount);
  // Sorted as the engine has it: rooms stand after what they hold, and before places.
  Erasure erasure;
  for (const char* id : {"O1", "O2", "R1", "R2", "p1", "p2", "p3"}) {
    erasure.nodes.push_back(*ParseNodeId(id));
  }
  for (int i = 0; i < kCount; ++i) erasure.nodes.push_back(PlantedId(i));
  // Roots first, that no policy may find the rest.
  std::sort(erasure.nodes.begin(), erasure.nodes.end(), [](NodeId a, NodeId b) {
    return std::make_pair(a.letter() != 'R', a) < std::make_pair(b.letter() != 'R', b);
  });
  for (const bool is_file : {false, true}) {
    for (int stop_count = 0;; stop_count += is_file ? 3 : 1) {
      SCOPED_TRACE(absl::StrCat(is_file ? "a file" : "one policy", " after ", stop_count));
      const TempFolder copy;
      const std::string path = copy.path() + "/store";
      fs::copy(base, path, fs::copy_options::recursive);
      bool was_cut_off = false;
      {
        const auto db = sqlite::OpenMapFile(path, kMap, sqlite::Database::Mode::kWrite);
        ASSERT_TRUE(db.ok()) << db.status();
        MapSpec spec;
        spec.name = kMap;
        EraseReport report;
        int left = stop_count;
        was_cut_off = !sqlite::EraseFromMap(
                           **db, spec, erasure,
                           [&] { return left-- > 0 ? absl::OkStatus() : absl::CancelledError(""); },
                           {}, &report, {.rows = 1})
                           .ok();
      }
      Open(path);
      const auto reply = Prune(is_file ? EraseBranches({"R1", "R2"}) : EraseBranches({"R1"}));
      core_.reset();
      EXPECT_EQ(SecretCount(path), 0);
      if (!was_cut_off) {
        EXPECT_EQ(reply.ok(), is_file) << "there was something left";
        break;
      }
      ASSERT_TRUE(reply.ok()) << reply.status();
      EXPECT_TRUE(reply->erased());
      ASSERT_LT(stop_count, 200);
    }
  }
}

TEST_F(EraseMeanwhileTest, WhatWasOnlyRetiredIsFound) {
  v1::PruneRequest request = EraseBranches({"R1"});
  // Cut off after each of its messages but for the erasing ones.
  for (int messages = 1; messages <= 3; ++messages) {
    auto cursor = core_->Prune(call_, request);
    ASSERT_TRUE(cursor.ok()) << cursor.status();
    for (int i = 0; i < messages; ++i) {
      v1::PruneResponse message;
      ASSERT_TRUE((*cursor)->Next(call_, &message).ok());
    }
  }
  EXPECT_FALSE(Has("R1"));
  EXPECT_TRUE(Has("R1", 2));
  Open(folder_.path());
  const auto reply = Prune(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_TRUE(reply->erased());
  EXPECT_FALSE(Has("R1", 2));
  EXPECT_EQ(SecretCount(folder_.path()), kCount / 2);
}

// Whatever another erasure says, something that was begun is done or remembered.
TEST_F(EraseMeanwhileTest, IsNotForgottenWhenAnotherOneFollows) {
  core_.reset();
  bool was_pending = false;
  bool was_ended_by_the_other = false;
  for (int messages = 1; messages <= 8; ++messages) {
    SCOPED_TRACE(absl::StrCat("cut off after ", messages, " messages"));
    const TempFolder copy;
    const std::string path = copy.path() + "/store";
    fs::copy(folder_.path(), path, fs::copy_options::recursive);
    Open(path);
    {
      auto cursor = core_->Prune(call_, EraseBranches({"R1"}));
      ASSERT_TRUE(cursor.ok()) << cursor.status();
      for (int i = 0; i < messages && !(*cursor)->done(); ++i) {
        v1::PruneResponse message;
        ASSERT_TRUE((*cursor)->Next(call_, &message).ok());
      }
    }
    // Another process finds it, too.
    Open(path);
    const bool is_begun = Stats().has_pending_erasure();
    const auto other = Prune(EraseBranches({"R2"}));
    ASSERT_TRUE(other.ok()) << other.status();
    EXPECT_EQ(other->erased(), !Stats().has_pending_erasure());
    const bool is_gone = !Has("R1");
    core_.reset();
    const int left = SecretCount(path);
    // The names in R2 are gone. Those in R1 are believed still, or gone too, or it is not said.
    EXPECT_LE(left, kCount / 2);
    EXPECT_FALSE(is_gone && left > 0 && other->erased());
    was_pending = was_pending || !other->erased();
    was_ended_by_the_other = was_ended_by_the_other || (is_begun && other->erased());
    Open(path);
    const auto again = Prune(EraseBranches({"R1"}));
    EXPECT_TRUE(again.ok() ? again->erased() : ReasonOf(again.status()) == Reason::kNodeUnknown)
        << again.status();
    EXPECT_FALSE(Stats().has_pending_erasure());
    core_.reset();
    EXPECT_EQ(SecretCount(path), 0);
  }
  EXPECT_TRUE(was_ended_by_the_other);
  EXPECT_TRUE(was_pending);
}

TEST_F(EraseMeanwhileTest, ANodeWrittenAgainIsThereWithoutItsPast) {
  const auto reply = Prune(EraseBranches({"R1"}), [&](int message) {
    if (message <= 2) CommitNode(Thing(PlantedId(2 * message), "clean"));
  });
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_TRUE(reply->erased());
  EXPECT_EQ(reply->left_count(), 0);
  // One written before it was retired, one after that.
  EXPECT_EQ(reply->rewritten_count(), 2);
  ASSERT_EQ(reply->rewritten_ids_size(), 2);
  EXPECT_EQ(reply->rewritten_ids(0), "O7002");
  EXPECT_EQ(reply->rewritten_ids(1), "O7004");
  EXPECT_TRUE(Has("O7002"));
  EXPECT_FALSE(Has("O7002", 2));
  EXPECT_FALSE(Has("O7000"));
  core_.reset();
  EXPECT_EQ(SecretCount(folder_.path()), kCount / 2);
  EXPECT_GT(PoseCountBefore(NodeId('H', 12), kTimeMax), 0);
}

TEST_F(EraseMeanwhileTest, NoSecretStaysOfNodesThatARobotWritesAllTheTime) {
  std::atomic<bool> is_over = false;
  std::thread robot([&] {
    for (int i = 0; !is_over; ++i) CommitNode(Thing(PlantedId(2 * (i % 3)), "clean"));
  });
  const auto reply = Prune(EraseBranches({"R1"}));
  is_over = true;
  robot.join();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_TRUE(reply->erased());
  core_.reset();
  EXPECT_EQ(SecretCount(folder_.path()), kCount / 2);
}

TEST_F(EraseMeanwhileTest, ATrackCorrectedMeanwhileIsPlannedAgain) {
  v1::PruneRequest request;
  request.set_map(kMap);
  request.add_policies()->set_before_ns(10 * kSecond);
  request.mutable_policies(0)->set_strength(v1::ERASE);
  const auto reply = Prune(request, [&](int message) {
    if (message == 1) CorrectTrack();
  });
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_TRUE(reply->erased());
  EXPECT_EQ(reply->left_count(), 0);
  core_.reset();
  EXPECT_EQ(PoseCountBefore(NodeId('H', 12), 10 * kSecond), 0);
}

TEST_F(EraseMeanwhileTest, ATrackCorrectedWithoutEndIsLeftAndNamed) {
  v1::PruneRequest request;
  request.set_map(kMap);
  request.add_policies()->set_before_ns(10 * kSecond);
  request.mutable_policies(0)->set_strength(v1::ERASE);
  const auto reply = Prune(request, [&](int) { CorrectTrack(); });
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_FALSE(reply->erased());
  EXPECT_EQ(reply->left_count(), 1);
  ASSERT_EQ(reply->left_ids_size(), 1);
  EXPECT_EQ(reply->left_ids(0), "H12");
  const auto again = Prune(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->erased());
  core_.reset();
  EXPECT_EQ(PoseCountBefore(NodeId('H', 12), 10 * kSecond), 0);
}

TEST_F(EraseMeanwhileTest, AnAgentThatComesBackIsRetiredAgainOrLeftAndNamed) {
  auto store = GraphStore::Open(folder_.path(), {});
  const Node agent = *(*(*(*store)->OpenMap(kMap))->Latest())->GetNode(NodeId('H', 12));
  for (const int message_count : {1, 2, 100}) {
    SCOPED_TRACE(absl::StrCat("comes back after messages up to ", message_count));
    const TempFolder copy;
    fs::copy(folder_.path(), copy.path() + "/store", fs::copy_options::recursive);
    Open(copy.path() + "/store");
    sequence_ = 0;
    const auto reply = Prune(EraseBranches({"H12"}), [&](int message) {
      if (message <= message_count) CommitNode(agent);
    });
    ASSERT_TRUE(reply.ok()) << reply.status();
    const bool is_left = message_count == 100;
    EXPECT_EQ(reply->erased(), !is_left);
    EXPECT_EQ(reply->left_count(), is_left ? 1 : 0);
    EXPECT_EQ(Has("H12"), is_left);
    core_.reset();
  }
}

}  // namespace
}  // namespace dsg::test
