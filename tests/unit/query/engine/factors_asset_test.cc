// SPDX-License-Identifier: Apache-2.0
// ListFactors and GetAsset in process: what is sent, in how many messages, what is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "query/api/stream_cursor.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

using query::CallContext;

const NodeId kSpot('r', 1);

// Follows seed and index, so that no two bytes in a row are alike.
std::string ContentOf(size_t size) {
  std::string content(size, '\0');
  for (size_t i = 0; i < size; ++i) content[i] = static_cast<char>((i * 2654435761u) >> 13);
  return content;
}

PoseFactor FactorAt(TimeNs from_ns, TimeNs to_ns, const char* type) {
  PoseFactor factor;
  factor.type = type;
  factor.from_ns = from_ns;
  factor.to_ns = to_ns;
  factor.relative_pose.position = Eigen::Vector3d(0.1, 0, 1e-9 * static_cast<double>(from_ns));
  return factor;
}

// Spot moves from 5 s to 900 s. It has a prior long before its track, one odometry factor every
// 0.1 s of the first 250 s, loop closures from the first second to each minute, and one odometry
// factor after an hour's gap.
class FactorsAndAssets : public testing::Test {
 protected:
  FactorsAndAssets() {
    MakeOffice(folder_.path());
    GraphDelta delta;
    delta.appends = {{kSpot, {}}};
    for (int s = 6; s <= 900; ++s) delta.appends[0].poses.push_back(PoseAt(s * kSecond, s, 0, 0));
    delta.appends[0].poses.push_back(PoseAt(4500 * kSecond, 0, 0, 0));
    FactorAppend factors{kSpot, {}};
    factors.factors.push_back(FactorAt(-100 * kSecond, -100 * kSecond, "detection_prior"));
    for (int i = 0; i < 2500; ++i) {
      factors.factors.push_back(FactorAt(i * kSecond / 10, (i + 1) * kSecond / 10, "odometry"));
    }
    for (int minute = 1; minute <= 10; ++minute) {
      factors.factors.push_back(FactorAt(kSecond, minute * 60 * kSecond, "loop_closure"));
    }
    factors.factors.push_back(FactorAt(4400 * kSecond, 4500 * kSecond, "odometry"));
    factors.factors.front().information = Covariance6{};
    factors.factors.front().information->front() = 4.0f;
    delta.factors = {factors};
    CommitToOffice(folder_.path(), std::move(delta));
    core_ = OpenCore(folder_.path());
    request_.set_map(kMap);
    request_.set_agent("spot");
  }

  absl::StatusOr<std::vector<v1::ListFactorsResponse>> Factors(
      const CallContext& call = CallContext()) {
    std::vector<v1::ListFactorsResponse> messages;
    DSG_RETURN_IF_ERROR(query::ReadStream(call, core_->ListFactors(call, request_),
                                          [&](const v1::ListFactorsResponse& message) {
                                            messages.push_back(message);
                                            return true;
                                          }));
    return messages;
  }

  std::vector<TimeNs> Begins() {
    std::vector<TimeNs> begins;
    const auto messages = Factors();
    EXPECT_TRUE(messages.ok()) << messages.status();
    if (!messages.ok()) return begins;
    for (const auto& message : *messages) {
      for (const auto& factor : message.factors()) begins.push_back(factor.from_time_ns());
    }
    return begins;
  }

  // What the store says, filtered as the proto has it.
  std::vector<TimeNs> Expected(TimeNs from_ns, TimeNs to_ns) {
    const auto store = *GraphStore::Open(folder_.path(), {});
    const auto all = (*(*store->OpenMap(kMap))->Latest())->Factors(kSpot, kTimeMin, kTimeMax);
    EXPECT_TRUE(all.ok()) << all.status();
    std::vector<TimeNs> begins;
    for (const PoseFactor& factor : *all) {
      if (factor.from_ns >= from_ns && factor.from_ns < to_ns) begins.push_back(factor.from_ns);
    }
    return begins;
  }

  absl::StatusOr<std::vector<v1::GetAssetResponse>> AssetOf(const std::string& sha256) {
    v1::GetAssetRequest request;
    request.set_map(kMap);
    request.set_sha256(sha256);
    std::vector<v1::GetAssetResponse> messages;
    const CallContext call;
    DSG_RETURN_IF_ERROR(query::ReadStream(call, core_->GetAsset(call, request),
                                          [&](const v1::GetAssetResponse& message) {
                                            messages.push_back(message);
                                            return true;
                                          }));
    return messages;
  }

  Asset Store(const std::string& content) {
    GraphDelta delta;
    delta.assets = {{ComputeSha256(content), "model/ply", content}};
    CommitToOffice(folder_.path(), delta);
    return delta.assets.front();
  }

  static std::string BytesOf(const Sha256& sha256) { return {sha256.begin(), sha256.end()}; }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  v1::ListFactorsRequest request_;
};

TEST_F(FactorsAndAssets, ListsAllFactorsInOrderAThousandAMessage) {
  const auto messages = Factors();
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 3u);
  EXPECT_EQ((*messages)[0].header().read_revision(), 2);
  EXPECT_EQ((*messages)[0].agent_id(), "r1");
  EXPECT_FALSE((*messages)[1].has_header());
  for (const auto& message : *messages) EXPECT_LE(message.factors_size(), 1000);
  const std::vector<TimeNs> begins = Begins();
  EXPECT_EQ(begins.size(), 2512u);
  EXPECT_TRUE(std::is_sorted(begins.begin(), begins.end()));
  EXPECT_EQ(begins, Expected(kTimeMin, kTimeMax));
}

TEST_F(FactorsAndAssets, TellsWhatAFactorSays) {
  request_.set_to_ns(0);
  const auto messages = Factors();
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 1u);
  ASSERT_EQ(messages->front().factors_size(), 1);
  const v1::PoseFactor& prior = messages->front().factors(0);
  EXPECT_EQ(prior.type(), "detection_prior");
  EXPECT_EQ(prior.to_time_ns(), -100 * kSecond);
  EXPECT_NEAR(prior.relative_pose().position().z(), -100.0, 1e-9);
  ASSERT_EQ(prior.information_size(), 21);
  EXPECT_EQ(prior.information(0), 4.0f);
}

TEST_F(FactorsAndAssets, ListsThoseThatBeginInTheInterval) {
  for (const auto& [from_s, to_s] : std::vector<std::pair<int, int>>{
           {-1000, -100}, {-100, 0}, {1, 2}, {1, 100}, {240, 5000}, {901, 4400}, {4400, 4401}}) {
    SCOPED_TRACE(std::to_string(from_s) + " s to " + std::to_string(to_s) + " s");
    request_.set_from_ns(from_s * kSecond);
    request_.set_to_ns(to_s * kSecond);
    EXPECT_EQ(Begins(), Expected(from_s * kSecond, to_s * kSecond));
  }
}

TEST_F(FactorsAndAssets, SendsAHeaderWhenThereIsNoFactor) {
  request_.set_agent("H12");
  const auto messages = Factors();
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 1u);
  EXPECT_EQ(messages->front().header().read_revision(), 2);
  EXPECT_EQ(messages->front().agent_id(), "H12");
  request_.set_agent("spot");
  request_.mutable_read_at()->set_exact_revision(1);
  EXPECT_TRUE(Begins().empty());
}

TEST_F(FactorsAndAssets, RefusesUnknownAgentsAndInvertedIntervals) {
  request_.set_agent("nobody");
  EXPECT_EQ(ReasonOf(Factors().status()), Reason::kAgentUnknown);
  request_.set_agent("spot");
  request_.set_from_ns(5);
  request_.set_to_ns(5);
  EXPECT_EQ(ReasonOf(Factors().status()), Reason::kTimeRangeInverted);
  CallContext call;
  call.Cancel();
  EXPECT_TRUE(absl::IsCancelled(Factors(call).status()));
}

TEST_F(FactorsAndAssets, SendsAnAssetInPartsOfAMebibyte) {
  const std::string content = ContentOf((size_t{5} << 19) + 7);
  const Asset asset = Store(content);
  const auto messages = AssetOf(BytesOf(asset.sha256));
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 3u);
  const v1::GetAssetResponse& first = messages->front();
  EXPECT_EQ(first.header().read_revision(), 3);
  EXPECT_EQ(first.media_type(), "model/ply");
  EXPECT_EQ(first.size_bytes(), static_cast<int64_t>(content.size()));
  EXPECT_FALSE((*messages)[1].has_header());
  std::string joined;
  for (const auto& message : *messages) {
    EXPECT_LE(message.content().size(), size_t{1} << 20);
    joined += message.content();
  }
  EXPECT_TRUE(joined == content);
}

TEST_F(FactorsAndAssets, SendsAWholeNumberOfPartsAndAnEmptyAsset) {
  for (const size_t size : {size_t{2} << 20, size_t{1}, size_t{0}}) {
    const std::string content = ContentOf(size);
    const auto messages = AssetOf(BytesOf(Store(content).sha256));
    ASSERT_TRUE(messages.ok()) << messages.status();
    EXPECT_EQ(messages->size(), size > 1 ? 2u : 1u);
    EXPECT_EQ(messages->front().size_bytes(), static_cast<int64_t>(size));
  }
}

// A backend that stores no parts cuts the whole asset; both ways give the same.
TEST_F(FactorsAndAssets, PartsAreThoseOfTheWholeAsset) {
  const std::string content = ContentOf((size_t{1} << 20) + 1);
  const Sha256 sha256 = Store(content).sha256;
  const auto store = *GraphStore::Open(folder_.path(), {});
  const auto snapshot = *(*store->OpenMap(kMap))->Latest();
  for (const int64_t index : {0, 1}) {
    const auto stored = snapshot->ReadAssetPart(sha256, index);
    const auto cut = snapshot->Snapshot::ReadAssetPart(sha256, index);
    ASSERT_TRUE(stored.ok()) << stored.status();
    ASSERT_TRUE(cut.ok()) << cut.status();
    EXPECT_TRUE(stored->content == cut->content);
    EXPECT_EQ(stored->media_type, cut->media_type);
    EXPECT_EQ(stored->part_count, cut->part_count);
    EXPECT_EQ(stored->size_bytes, cut->size_bytes);
  }
  for (const int64_t index : {-1, 2}) {
    EXPECT_EQ(ReasonOf(snapshot->ReadAssetPart(sha256, index).status()), Reason::kAssetUnknown);
    EXPECT_EQ(ReasonOf(snapshot->Snapshot::ReadAssetPart(sha256, index).status()),
              Reason::kAssetUnknown);
  }
}

TEST_F(FactorsAndAssets, RefusesUnknownAssetsAndWhatIsNoDigest) {
  EXPECT_EQ(ReasonOf(AssetOf(std::string(32, 'x')).status()), Reason::kAssetUnknown);
  EXPECT_EQ(ReasonOf(AssetOf(std::string(31, 'x')).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(AssetOf("").status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::test
