// SPDX-License-Identifier: Apache-2.0
// Forgetting as the service has it. What each policy takes is in tests/unit/schema/retention.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

using query::CallContext;

class PruneCallTest : public testing::Test {
 protected:
  PruneCallTest() {
    MakeOffice(folder_.path());
    core_ = OpenCore(folder_.path());
    request_.set_map(kMap);
  }

  absl::StatusOr<v1::PruneResponse> Prune() {
    v1::PruneResponse all;
    double progress = 0.0;
    DSG_RETURN_IF_ERROR(query::ReadStream(
        call_, core_->Prune(call_, request_), [&](const v1::PruneResponse& message) {
          EXPECT_GE(message.progress(), progress);
          progress = message.progress();
          if (message_count_++ == 0) {
            EXPECT_EQ(message.policies_size(), request_.policies_size());
            EXPECT_GT(message.map_before().node_count(), 0);
          }
          all.MergeFrom(message);
          return true;
        }));
    EXPECT_EQ(all.done(), true);
    return all;
  }

  bool Has(const std::string& id, Revision revision = 0) {
    v1::GetNodeRequest request;
    request.set_map(kMap);
    request.set_id(id);
    if (revision > 0) request.mutable_read_at()->set_exact_revision(revision);
    v1::GetNodeResponse reply;
    return core_->GetNode(call_, request, &reply).ok();
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  CallContext call_;
  v1::PruneRequest request_;
  int message_count_ = 0;
};

TEST_F(PruneCallTest, TellsWhatGoesThenRetiresIt) {
  request_.add_policies()->set_branch("R1");
  const auto reply = Prune();
  ASSERT_TRUE(reply.ok()) << reply.status();
  // R1, p1, p2, O1.
  EXPECT_EQ(reply->policies(0).matched().node_count(), 4);
  EXPECT_EQ(reply->policies(0).name(), "branch R1");
  EXPECT_EQ(reply->map_after().node_count(), reply->map_before().node_count() - 4);
  EXPECT_LT(reply->map_after().byte_count(), reply->map_before().byte_count());
  EXPECT_EQ(reply->revision(), 3);
  EXPECT_FALSE(Has("R1"));
  EXPECT_TRUE(Has("R1", 1));
  EXPECT_TRUE(Has("R2"));
}

TEST_F(PruneCallTest, ADryRunChangesNothing) {
  request_.add_policies()->set_layer("objects");
  request_.set_dry_run(true);
  const auto reply = Prune();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->policies(0).matched().node_count(), 2);
  EXPECT_EQ(reply->map_after().node_count(), reply->map_before().node_count());
  EXPECT_EQ(reply->revision(), 0);
  EXPECT_EQ(message_count_, 1);
  EXPECT_TRUE(Has("O1"));
}

TEST_F(PruneCallTest, AskedAgainFindsNothingLeft) {
  request_.add_policies()->set_before_ns(10 * kSecond);
  ASSERT_TRUE(Prune().ok());
  const auto again = Prune();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->policies(0).matched().pose_count(), 0);
  EXPECT_EQ(again->revision(), 0);
}

TEST_F(PruneCallTest, RefusesToForgetEverythingUnlessTold) {
  request_.add_policies()->set_before_ns(1000 * kSecond);
  EXPECT_EQ(ReasonOf(Prune().status()), Reason::kPolicyMatchesAll);
  EXPECT_TRUE(Has("H12"));
  request_.set_allow_everything(true);
  ASSERT_TRUE(Prune().ok());
  EXPECT_FALSE(Has("H12"));
}

TEST_F(PruneCallTest, RefusesToTakeMoreThanTheShareAndADryRunSaysSo) {
  request_.add_policies()->set_layer("objects");
  const auto unlimited = [&] {
    request_.set_dry_run(true);
    auto reply = Prune();
    request_.set_dry_run(false);
    return reply;
  };
  EXPECT_EQ(unlimited()->refusal(), "");
  request_.set_share_max(0.01);
  const auto dry = unlimited();
  ASSERT_TRUE(dry.ok()) << dry.status();
  EXPECT_TRUE(Has("O1"));
  const auto refused = Prune();
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kPolicyTakesTooMuch);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(std::string(refused.status().message()), dry->refusal());
  auto metadata = MetadataOf(refused.status());
  EXPECT_EQ(metadata["map"], kMap);
  EXPECT_EQ(metadata["policy"], "layer objects");
  EXPECT_EQ(metadata["share_max"], "0.01");
  EXPECT_GT(std::stod(metadata["share"]), 0.01);
  EXPECT_TRUE(Has("O1"));
  request_.set_share_max(1.0);
  const auto done = Prune();
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->policies(0).matched().node_count(), dry->policies(0).matched().node_count());
  EXPECT_FALSE(Has("O1"));
}

TEST_F(PruneCallTest, ADryRunSaysThatEverythingWouldGo) {
  request_.add_policies()->set_before_ns(1000 * kSecond);
  request_.set_dry_run(true);
  const auto dry = Prune();
  ASSERT_TRUE(dry.ok()) << dry.status();
  request_.set_dry_run(false);
  EXPECT_EQ(std::string(Prune().status().message()), dry->refusal());
  request_.set_dry_run(true);
  request_.set_allow_everything(true);
  EXPECT_EQ(Prune()->refusal(), "");
}

TEST_F(PruneCallTest, RefusesSharesThatAreNone) {
  request_.add_policies()->set_layer("objects");
  for (const double share : {-0.1, 1.1, std::nan("")}) {
    request_.set_share_max(share);
    EXPECT_EQ(ReasonOf(Prune().status()), Reason::kFieldInvalid) << share;
  }
}

TEST_F(PruneCallTest, NamesAgentsThatAreAhead) {
  GraphDelta delta;
  delta.nodes = {MakeNode(NodeId('H', 99), layers::kAgents, kinds::kHuman, "late", Box3d())};
  TimedPose pose;
  pose.time_ns = 5 * 365 * 86'400 * kSecond;
  delta.appends = {{NodeId('H', 99), {pose}}};
  CommitToOffice(folder_.path(), delta);
  core_ = OpenCore(folder_.path());
  request_.add_policies()->set_older_than_ns(86'400 * kSecond);
  const auto reply = Prune();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->policies(0).matched().pose_count(), 0);
  ASSERT_EQ(reply->implausible_ids_size(), 1);
  EXPECT_EQ(reply->implausible_ids(0), "H99");
  ASSERT_EQ(reply->notes_size(), 1);
}

TEST_F(PruneCallTest, HistoryPoliciesCompact) {
  for (uint64_t i = 0; i < 5; ++i) {
    GraphDelta delta;
    delta.nodes = {MakeNode(NodeId('O', 100 + i), layers::kObjects, kinds::kObject, "thing",
                            Box3d(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()))};
    CommitToOffice(folder_.path(), delta);
  }
  core_ = OpenCore(folder_.path());
  request_.add_policies()->set_history_before_revision(4);
  const auto reply = Prune();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->policies(0).matched().revision_count(), 3);
  EXPECT_FALSE(Has("R1", 3));
  EXPECT_TRUE(Has("R1", 4));
}

TEST_F(PruneCallTest, CountsApartTheStaysThatOnlyLoseTheirPlaceAndTheLog) {
  request_.add_policies()->set_branch("p1");
  const auto reply = Prune();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->policies(0).matched().stay_count(), 0);
  EXPECT_EQ(reply->policies(0).matched().stay_edit_count(), 2);
  EXPECT_EQ(reply->map_after().stay_count(), reply->map_before().stay_count());
  EXPECT_GT(reply->log_bytes_after(), 0);
  EXPECT_LT(reply->log_bytes_after(), reply->file_bytes_after());
}

TEST_F(PruneCallTest, NamesOfPoliciesHaveDatesOnlyOnAClockThatHasThem) {
  request_.add_policies()->set_before_ns(2 * kSecond);
  request_.add_policies()->set_unseen_since_ns(1 * kSecond);
  request_.set_dry_run(true);
  const auto reply = Prune();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->policies(0).name(), "before +2s");
  EXPECT_EQ(reply->policies(1).name(), "unseen since +1s");
}

TEST_F(PruneCallTest, NamesWhatIsWrong) {
  EXPECT_EQ(ReasonOf(Prune().status()), Reason::kFieldInvalid);
  request_.add_policies()->set_branch("R99");
  EXPECT_EQ(ReasonOf(Prune().status()), Reason::kNodeUnknown);
  request_.mutable_policies(0)->set_layer("attics");
  EXPECT_EQ(ReasonOf(Prune().status()), Reason::kLayerUnknown);
  request_.mutable_policies(0)->set_older_than_ns(-1);
  EXPECT_EQ(ReasonOf(Prune().status()), Reason::kFieldInvalid);
  request_.mutable_policies(0)->set_layer("mesh");
  request_.mutable_policies(0)->set_strength(static_cast<v1::PruneStrength>(77));
  EXPECT_EQ(MetadataOf(Prune().status())["field"], "policies.strength");
  EXPECT_EQ(MetadataOf(Prune().status())["value"], "77");
  request_.mutable_policies(0)->clear_strength();
  request_.mutable_policies(0)->mutable_region_map()->mutable_min()->set_x(5);
  request_.mutable_policies(0)->mutable_region_map()->mutable_max()->set_x(1);
  EXPECT_EQ(ReasonOf(Prune().status()), Reason::kBoxInverted);
  request_.set_map("cellar");
  EXPECT_EQ(ReasonOf(Prune().status()), Reason::kMapUnknown);
}

TEST_F(PruneCallTest, EraseLeavesNoRevisionThatKnows) {
  v1::PrunePolicy* const policy = request_.add_policies();
  policy->set_branch("R1");
  policy->set_strength(v1::ERASE);
  const auto reply = Prune();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_TRUE(reply->erased());
  EXPECT_FALSE(Has("R1"));
  EXPECT_FALSE(Has("R1", 1));
  EXPECT_TRUE(Has("R2", 1));
  // Again: nothing is left of it, not even in the past.
  EXPECT_EQ(ReasonOf(Prune().status()), Reason::kNodeUnknown);
}

int HitCount(const std::string& bytes, const std::vector<std::string>& patterns) {
  return static_cast<int>(std::count_if(
      patterns.begin(), patterns.end(),
      [&](const std::string& pattern) { return bytes.find(pattern) != std::string::npos; }));
}

TEST_F(PruneCallTest, EraseLeavesNoByteOfAHundredPlantedNamesInTheStoreOrACopyOfIt) {
  core_.reset();
  std::vector<std::string> patterns;
  // Two names a thing, one after the other; some things are gone again before.
  for (uint64_t version = 0; version < 2; ++version) {
    GraphDelta delta;
    for (uint64_t i = 0; i < 50; ++i) {
      patterns.push_back("planted-" + std::to_string(version) + "-" + std::to_string(7919 * i));
      const Eigen::Vector3d corner(1.0 + 0.05 * static_cast<double>(i), 2, 0);
      delta.nodes.push_back(MakeNode(NodeId('O', 500 + i), layers::kObjects, kinds::kObject,
                                     patterns.back(), Box3d(corner, corner.array() + 0.1)));
      if (version > 0) continue;
      Edge edge{NodeId('R', 1), relations::kContains, NodeId('O', 500 + i)};
      delta.edges.push_back(edge);
    }
    CommitToOffice(folder_.path(), delta);
  }
  GraphDelta gone;
  for (uint64_t i = 0; i < 10; ++i) gone.retirements.push_back({NodeId('O', 500 + i), {}});
  CommitToOffice(folder_.path(), gone);
  EXPECT_EQ(HitCount(ReadFolder(folder_.path()), patterns), 100);

  core_ = OpenCore(folder_.path());
  v1::PrunePolicy* const policy = request_.add_policies();
  policy->set_branch("R1");
  policy->set_strength(v1::ERASE);
  const auto reply = Prune();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_TRUE(reply->erased());
  EXPECT_EQ(HitCount(ReadFolder(folder_.path()), patterns), 0);
  core_.reset();
  const TempFolder copy;
  auto store = GraphStore::Open(folder_.path(), {});
  ASSERT_TRUE(store.ok()) << store.status();
  auto map = (*store)->OpenMap(kMap);
  ASSERT_TRUE(map.ok()) << map.status();
  ASSERT_TRUE((*map)->CopyTo(copy.path() + "/copy.db", StopCheck(), Progress()).ok());
  EXPECT_EQ(HitCount(ReadFolder(copy.path()), patterns), 0);
  const auto verified = (*map)->Verify({}, {});
  ASSERT_TRUE(verified.ok()) << verified.status();
  EXPECT_TRUE(verified->problems.empty()) << verified->problems.front();
}

TEST_F(PruneCallTest, EraseOfATimeLeavesNoRevisionThatKnowsWhereSomebodyWas) {
  v1::PrunePolicy* const policy = request_.add_policies();
  policy->set_before_ns(10 * kSecond);
  policy->set_strength(v1::ERASE);
  ASSERT_TRUE(Prune().ok());
  core_.reset();
  auto store = GraphStore::Open(folder_.path(), {});
  ASSERT_TRUE(store.ok()) << store.status();
  auto map = (*store)->OpenMap(kMap);
  ASSERT_TRUE(map.ok()) << map.status();
  for (Revision revision = 1; revision <= 2; ++revision) {
    const auto then = (*map)->At(revision);
    ASSERT_TRUE(then.ok()) << then.status();
    const auto tracks = (*then)->Tracks();
    ASSERT_TRUE(tracks.ok()) << tracks.status();
    for (const TrackInfo& track : *tracks) {
      EXPECT_TRUE(track.pose_count == 0 || track.first_ns >= 10 * kSecond);
    }
  }
  const auto verified = (*map)->Verify({}, {});
  ASSERT_TRUE(verified.ok()) << verified.status();
  EXPECT_TRUE(verified->problems.empty()) << verified->problems.front();
}

TEST_F(PruneCallTest, EraseGoesOnWhereAPruneWasCutOff) {
  v1::PrunePolicy* const policy = request_.add_policies();
  policy->set_branch("R1");
  ASSERT_TRUE(Prune().ok());
  EXPECT_TRUE(Has("O1", 1));
  policy->set_strength(v1::ERASE);
  const auto reply = Prune();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_FALSE(Has("O1", 1));
}

}  // namespace
}  // namespace dsg::test
