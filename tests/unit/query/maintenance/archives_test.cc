// SPDX-License-Identifier: Apache-2.0
// Archives that are being read: how many at once, for how long, and what an erasure does to them.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

#include "absl/strings/match.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/maintenance/archives.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

using ArchiveCursor = query::StreamCursor<v1::ReadArchiveResponse>;
using query::CallContext;

// Copies of maps that this process holds open, though no name is left of them.
int OpenCopyCount() {
  int count = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    const std::string target = fs::read_symlink(entry.path(), error).string();
    if (absl::StrContains(target, "/.archive-")) ++count;
  }
  return count;
}

// An archive of more than one piece: what cannot be packed makes it large.
Asset LargeAsset() {
  Random random(1, 0);
  Asset asset;
  asset.media_type = "application/octet-stream";
  for (int i = 0; i < 3'000'000; ++i) {
    asset.content.push_back(static_cast<char>(random.Integer(0, 255)));
  }
  asset.sha256 = ComputeSha256(asset.content);
  return asset;
}

class ArchiveCopiesTest : public testing::Test {
 protected:
  ArchiveCopiesTest() {
    MakeOffice(folder_.path());
    GraphDelta delta;
    delta.assets = {LargeAsset()};
    CommitToOffice(folder_.path(), std::move(delta));
    limits_.now = [this] { return query::ArchiveLimits::Clock::time_point(now_.load()); };
  }

  void OpenCore() {
    auto store = GraphStore::Open(folder_.path(), {});
    core_ = query::MakeServiceCore(*std::move(store), {.archives = limits_});
  }

  query::CursorOr<v1::ReadArchiveResponse> Open() {
    v1::ReadArchiveRequest request;
    request.set_map(kMap);
    return core_->ReadArchive(call_, request);
  }

  // One that has given its first piece, and has others.
  std::unique_ptr<ArchiveCursor> Begun() {
    auto cursor = Open();
    EXPECT_TRUE(cursor.ok()) << cursor.status();
    EXPECT_TRUE(Next(cursor->get()).ok());
    EXPECT_FALSE((*cursor)->done());
    return *std::move(cursor);
  }

  absl::Status Next(ArchiveCursor* cursor) {
    v1::ReadArchiveResponse piece;
    return cursor->Next(call_, &piece).status();
  }

  absl::StatusOr<bool> EraseCup() {
    v1::PruneRequest request;
    request.set_map(kMap);
    v1::PrunePolicy* const policy = request.add_policies();
    policy->set_branch("O1");
    policy->set_strength(v1::ERASE);
    bool is_erased = false;
    DSG_RETURN_IF_ERROR(query::ReadStream(call_, core_->Prune(call_, request),
                                          [&](const v1::PruneResponse& message) {
                                            is_erased = message.erased();
                                            return true;
                                          }));
    return is_erased;
  }

  std::string MakeLeftover(const std::string& name) {
    fs::create_directories(folder_.path() + "/" + name + "/office");
    std::ofstream(folder_.path() + "/" + name + "/office/graph.db.new") << "half a copy";
    return folder_.path() + "/" + name;
  }

  TempFolder folder_;
  query::ArchiveLimits limits_;
  std::atomic<std::chrono::nanoseconds> now_{std::chrono::nanoseconds(0)};
  std::unique_ptr<query::ServiceCore> core_;
  CallContext call_;
};

TEST_F(ArchiveCopiesTest, AFewAreReadAtATime) {
  OpenCore();
  std::vector<std::unique_ptr<ArchiveCursor>> cursors;
  for (int i = 0; i < limits_.count_max; ++i) cursors.push_back(Begun());
  EXPECT_EQ(OpenCopyCount(), limits_.count_max);
  const absl::Status refused = Open().status();
  EXPECT_EQ(ReasonOf(refused), Reason::kOverloaded);
  EXPECT_TRUE(absl::StrContains(refused.message(), "try again"));
  cursors.pop_back();
  EXPECT_EQ(OpenCopyCount(), limits_.count_max - 1);
  // Read to its end, it keeps nothing either.
  const auto whole = Begun();
  while (!whole->done()) ASSERT_TRUE(Next(whole.get()).ok());
  EXPECT_EQ(OpenCopyCount(), limits_.count_max - 1);
  EXPECT_TRUE(Open().ok());
}

TEST_F(ArchiveCopiesTest, AnIdleReaderMakesPlaceForOthers) {
  limits_.count_max = 1;
  OpenCore();
  const auto idle = Begun();
  now_ = std::chrono::seconds(59);
  EXPECT_EQ(ReasonOf(Open().status()), Reason::kOverloaded);
  now_ = std::chrono::seconds(60);
  const auto other = Begun();
  const absl::Status ended = Next(idle.get());
  EXPECT_EQ(ReasonOf(ended), Reason::kOverloaded);
  EXPECT_TRUE(absl::StrContains(ended.message(), "nothing was taken")) << ended;
  EXPECT_EQ(OpenCopyCount(), 1);
  // Who reads on is not idle, however long it takes.
  now_ = std::chrono::seconds(119);
  EXPECT_TRUE(Next(other.get()).ok());
  now_ = std::chrono::seconds(178);
  EXPECT_TRUE(Next(other.get()).ok());
}

TEST_F(ArchiveCopiesTest, TheCopyOfAnIdleReaderGoesThoughNobodyAsks) {
  limits_.idle_max = std::chrono::milliseconds(40);
  OpenCore();
  const auto idle = Begun();
  EXPECT_EQ(OpenCopyCount(), 1);
  now_ = limits_.idle_max;
  while (OpenCopyCount() > 0) std::this_thread::yield();
  EXPECT_EQ(ReasonOf(Next(idle.get())), Reason::kOverloaded);
}

TEST_F(ArchiveCopiesTest, AnErasureEndsTheArchivesOfItsMap) {
  OpenCore();
  const auto before = Begun();
  const auto never_read = Open();
  const auto erased = EraseCup();
  ASSERT_TRUE(erased.ok()) << erased.status();
  EXPECT_TRUE(*erased);
  EXPECT_EQ(OpenCopyCount(), 0);
  const absl::Status ended = Next(before.get());
  EXPECT_EQ(ReasonOf(ended), Reason::kMapReplaced);
  EXPECT_TRUE(absl::StrContains(ended.message(), "erased")) << ended;
  EXPECT_EQ(ReasonOf(Next(never_read->get())), Reason::kMapReplaced);
  const auto after = Begun();
  while (!after->done()) ASSERT_TRUE(Next(after.get()).ok());
}

TEST_F(ArchiveCopiesTest, AnErasureOfNothingLeavesArchivesAlone) {
  OpenCore();
  const auto cursor = Begun();
  v1::PruneRequest request;
  request.set_map(kMap);
  for (const char* branch : {"R77", "R78"}) {
    v1::PrunePolicy* const policy = request.add_policies();
    policy->set_branch(branch);
    policy->set_strength(v1::ERASE);
  }
  v1::PruneResponse last;
  ASSERT_TRUE(
      query::ReadStream(call_, core_->Prune(call_, request), [&](const v1::PruneResponse& message) {
        last = message;
        return true;
      }).ok());
  EXPECT_TRUE(last.done());
  EXPECT_TRUE(last.erased());
  while (!cursor->done()) ASSERT_TRUE(Next(cursor.get()).ok());
}

TEST_F(ArchiveCopiesTest, RetiringLeavesArchivesAlone) {
  OpenCore();
  const auto cursor = Begun();
  v1::PruneRequest request;
  request.set_map(kMap);
  request.add_policies()->set_branch("O1");
  ASSERT_TRUE(query::ReadStream(call_, core_->Prune(call_, request), [](const v1::PruneResponse&) {
                return true;
              }).ok());
  EXPECT_TRUE(Next(cursor.get()).ok());
}

TEST_F(ArchiveCopiesTest, ArchivesOfOtherMapsGoOn) {
  const auto store = GraphStore::Open(folder_.path(), {});
  ASSERT_TRUE((*store)->CreateMap({.name = "attic"}).ok());
  query::ArchiveCopies copies((*store)->folder(), {});
  const auto office = copies.Begin(*(*store)->OpenMap(kMap));
  const auto attic = copies.Begin(*(*store)->OpenMap("attic"));
  copies.EndOf(kMap);
  EXPECT_FALSE((*office)->Next(nullptr, copies.limits()).ok());
  EXPECT_TRUE((*attic)->Next(nullptr, copies.limits()).ok());
}

TEST_F(ArchiveCopiesTest, AnArchiveThatIsBeingMadeIsStopped) {
  const auto store = GraphStore::Open(folder_.path(), {});
  query::ArchiveCopies copies((*store)->folder(), {});
  for (int i = 0; i < 5; ++i) {
    const auto read = copies.Begin(*(*store)->OpenMap(kMap));
    ASSERT_TRUE(read.ok()) << read.status();
    std::atomic<bool> is_begun{false};
    const auto stop = [&] {
      is_begun = true;
      return absl::OkStatus();
    };
    std::thread reader([&] { (*read)->Next(stop, copies.limits()).status().IgnoreError(); });
    while (!is_begun) std::this_thread::yield();
    copies.EndOf(kMap);
    EXPECT_EQ(OpenCopyCount(), 0);
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      EXPECT_FALSE(absl::StartsWith(entry.path().filename().string(), ".archive-"));
    }
    reader.join();
    EXPECT_EQ(ReasonOf((*read)->Next(nullptr, copies.limits()).status()), Reason::kMapReplaced);
  }
}

TEST_F(ArchiveCopiesTest, WhatAKilledProcessLeftGoesAtTheNextStart) {
  const std::string archive = MakeLeftover(".archive-1-0.new");
  const std::string restore = MakeLeftover(".restore-1-0.new");
  OpenCore();
  EXPECT_FALSE(fs::exists(archive));
  EXPECT_FALSE(fs::exists(restore));
}

TEST_F(ArchiveCopiesTest, WhatAKilledProcessLeftGoesBeforeAnErasureIsAcknowledged) {
  OpenCore();
  const std::string archive = MakeLeftover(".archive-1-0.new");
  ASSERT_TRUE(EraseCup().ok());
  EXPECT_FALSE(fs::exists(archive));
}

}  // namespace
}  // namespace dsg::test
