// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/restore.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/match.h"
#include "tests/unit/schema/archive/archive_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

class RestoreTest : public testing::Test {
 protected:
  void SetUp() override {
    bytes_ = OrDie(ArchiveBytes(&map_->reader(), map_->folder()));
    WriteBytes(path(), bytes_);
    store_ = OrDie(GraphStore::Open(folder_.path() + "/store", {.create = true}));
  }

  absl::Status Restore(const RestoreOptions& options = {}) {
    return RestoreArchive(path(), store_.get(), options, nullptr, nullptr).status();
  }

  std::string path() const { return folder_.path() + "/map.dsgz"; }

  const std::unique_ptr<TestMap> map_ = MakeArchivedMap(20);
  TempFolder folder_;
  std::string bytes_;
  std::unique_ptr<GraphStore> store_;
};

TEST_F(RestoreTest, EveryRevisionAnswersAsBefore) {
  ASSERT_TRUE(Restore().ok()) << Restore();
  const auto restored = OrDie(store_->OpenMap(kMap));
  for (Revision r = 0; r <= 20; r += 5) {
    EXPECT_EQ(OrDie(Dump(*OrDie(restored->At(r)))), OrDie(Dump(*map_->At(r)))) << r;
  }
  EXPECT_EQ(OrDie(restored->Tags()).size(), 2U);
  EXPECT_TRUE(OrDie(restored->Verify({}, {})).problems.empty());
  EXPECT_EQ(NamesOf(store_->folder()), kMap);
}

TEST_F(RestoreTest, ArchivedAgainGivesTheSameBytes) {
  ASSERT_TRUE(Restore().ok());
  EXPECT_TRUE(OrDie(ArchiveBytes(store_.get(), kMap)) == bytes_);
}

TEST_F(RestoreTest, ACompactedMapArchivedAgainGivesTheSameBytes) {
  OrDie(map_->writer().Compact(15, nullptr, nullptr));
  bytes_ = OrDie(ArchiveBytes(&map_->reader(), map_->folder()));
  WriteBytes(path(), bytes_);
  ASSERT_TRUE(Restore().ok());
  EXPECT_TRUE(OrDie(ArchiveBytes(store_.get(), kMap)) == bytes_);
  EXPECT_EQ(OrDie(OrDie(store_->OpenMap(kMap))->OldestRevision()), 15);
}

TEST_F(RestoreTest, TheRestoredMapGoesOn) {
  ASSERT_TRUE(Restore().ok());
  const auto writer = OrDie(store_->OpenWriter(kMap));
  GraphDelta delta = DeltaOfNodes({MakeHuman(77, "new")});
  delta.session_id = "later";
  delta.sequence = 1;
  EXPECT_EQ(OrDie(writer->Commit(delta)).revision, 21);
}

TEST_F(RestoreTest, UnderAnotherNameIsAMapOfThatName) {
  ASSERT_TRUE(Restore({.name = "copy"}).ok());
  EXPECT_EQ(OrDie(store_->OpenMap("copy"))->spec().name, "copy");
  EXPECT_EQ(NamesOf(store_->folder()), "copy");
  ASSERT_TRUE(Restore().ok());
  EXPECT_EQ(OrDie(store_->ListMaps()).size(), 2U);
  EXPECT_EQ(ReasonOf(Restore({.name = "../copy"})), Reason::kMapNameInvalid);
}

TEST_F(RestoreTest, AMapThatIsThereStaysUnlessItMayGo) {
  ASSERT_TRUE(Restore().ok());
  const auto old_reader = OrDie(store_->OpenMap(kMap));
  EXPECT_EQ(ReasonOf(Restore()), Reason::kMapExists);
  EXPECT_TRUE(old_reader->IsCurrent());
  ASSERT_TRUE(Restore({.replace = true}).ok());
  EXPECT_FALSE(old_reader->IsCurrent());
  EXPECT_TRUE(OrDie(ArchiveBytes(store_.get(), kMap)) == bytes_);
}

TEST_F(RestoreTest, AMapThatIsWrittenIsNeverReplaced) {
  ASSERT_TRUE(Restore().ok());
  const auto writer = OrDie(store_->OpenWriter(kMap));
  const absl::Status status = Restore({.replace = true});
  EXPECT_EQ(ReasonOf(status), Reason::kWriterLocked) << status;
  EXPECT_TRUE(OrDie(store_->OpenMap(kMap))->IsCurrent());
  EXPECT_FALSE(absl::StrContains(NamesOf(store_->folder()), ".new"));
}

TEST_F(RestoreTest, StoppedLeavesNothing) {
  int questions = 0;
  const auto stop = [&] {
    return ++questions < 2 ? absl::OkStatus() : absl::CancelledError("enough");
  };
  EXPECT_TRUE(absl::IsCancelled(RestoreArchive(path(), store_.get(), {}, stop, nullptr).status()));
  EXPECT_EQ(NamesOf(store_->folder()), "");
}

TEST_F(RestoreTest, RemovesWhatAKilledOneLeft) {
  fs::create_directories(store_->folder() + "/.restore-1-0.new/office");
  WriteBytes(store_->folder() + "/.restore-1-0.new/office/graph.db.part", "half");
  ASSERT_TRUE(Restore().ok());
  EXPECT_EQ(NamesOf(store_->folder()), kMap);
}

TEST_F(RestoreTest, AnArchiveIsVerifiedWithoutAStore) {
  const auto report = VerifyArchive(path(), nullptr, nullptr);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->revision_count, 20);
  EXPECT_TRUE(report->problems.empty());
}

}  // namespace
}  // namespace dsg::test
