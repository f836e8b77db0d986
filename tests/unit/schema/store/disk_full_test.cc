// SPDX-License-Identifier: Apache-2.0
// A disk that fills up: writes fail cleanly, reads go on, and space is all that is needed again.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

// A disk of 6 MiB in memory. Mounting takes root; without it, `why_not` says so.
class SmallDisk {
 public:
  SmallDisk() {
    if (mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, "size=6m") != 0) {
      why_not_ = absl::StrCat("a small disk cannot be mounted here: ", std::strerror(errno));
    }
  }
  ~SmallDisk() {
    if (why_not_.empty()) umount2(folder_.path().c_str(), MNT_DETACH);
  }
  const std::string& path() const { return folder_.path(); }
  const std::string& why_not() const { return why_not_; }

  /// Takes all space but `spare_bytes`.
  void Fill(size_t spare_bytes) {
    const size_t available = std::filesystem::space(path()).available;
    if (available <= spare_bytes) return;
    std::ofstream file(path() + "/ballast", std::ios::app);
    file << std::string(available - spare_bytes, 'x');
  }
  void Free() { std::filesystem::remove(path() + "/ballast"); }

 private:
  TempFolder folder_;
  std::string why_not_;
};

// Commits deltas of the stream until one fails; the sequence of that one.
int64_t CommitUntilFull(GraphWriter* writer, int64_t sequence, const DeltaStreamOptions& options,
                        absl::Status* failure) {
  for (;; ++sequence) {
    *failure = writer->Commit(DeltaOfStream(options, sequence)).status();
    if (!failure->ok()) return sequence;
  }
}

TEST(FullDisk, FailsCommitsCleanlyWhileReadsGoOnAndForgetsItOnceThereIsSpace) {
  SmallDisk disk;
  if (!disk.why_not().empty()) GTEST_SKIP() << disk.why_not();
  const auto store = OrDie(GraphStore::Open(disk.path(), {}));
  ASSERT_TRUE(store->CreateMap(Spec(TrajectoryCodec::kQuantized)).ok());
  auto writer = OrDie(store->OpenWriter(kMap));
  const auto reader = OrDie(store->OpenMap(kMap));
  DeltaStreamOptions options;
  options.asset_bytes = 100'000;
  int64_t sequence = 1;
  for (; sequence <= 8; ++sequence) {
    ASSERT_TRUE(writer->Commit(DeltaOfStream(options, sequence)).ok());
  }
  for (const size_t spare_bytes : {size_t{0}, size_t{20'000}, size_t{60'000}}) {
    SCOPED_TRACE(absl::StrCat("spare bytes ", spare_bytes));
    disk.Fill(spare_bytes);
    absl::Status failure;
    sequence = CommitUntilFull(writer.get(), sequence, options, &failure);
    EXPECT_EQ(ReasonOf(failure), Reason::kDiskFull) << failure;
    EXPECT_EQ(failure.code(), absl::StatusCode::kResourceExhausted);
    // Again, since the first failure may have moved the writer to another state.
    EXPECT_EQ(ReasonOf(writer->Commit(DeltaOfStream(options, sequence)).status()),
              Reason::kDiskFull);
    EXPECT_EQ(OrDie(reader->Head()).revision, sequence - 1);
    EXPECT_TRUE(Dump(*OrDie(reader->Latest())).ok());
    EXPECT_TRUE(OrDie(reader->Verify({})).problems.empty());
    disk.Free();
    for (const int64_t stop = sequence + 3; sequence < stop; ++sequence) {
      const auto committed = writer->Commit(DeltaOfStream(options, sequence));
      ASSERT_TRUE(committed.ok()) << committed.status();
      EXPECT_EQ(committed->revision, sequence);
    }
  }
  EXPECT_TRUE(OrDie(reader->Verify({})).problems.empty());
  writer.reset();
  // What was written around the full disk equals what an undisturbed writer writes.
  TestMap undisturbed(Spec(TrajectoryCodec::kQuantized));
  for (int64_t s = 1; s < sequence; ++s) {
    ASSERT_TRUE(undisturbed.writer().Commit(DeltaOfStream(options, s)).ok());
  }
  EXPECT_EQ(OrDie(reader->Head()).digest, OrDie(undisturbed.reader().Head()).digest);
}

TEST(FullDisk, MakesNoHalfMap) {
  SmallDisk disk;
  if (!disk.why_not().empty()) GTEST_SKIP() << disk.why_not();
  const auto store = OrDie(GraphStore::Open(disk.path(), {}));
  disk.Fill(30'000);
  const absl::Status created = store->CreateMap(Spec(TrajectoryCodec::kQuantized));
  EXPECT_EQ(ReasonOf(created), Reason::kDiskFull) << created;
  EXPECT_TRUE(OrDie(store->ListMaps()).empty());
  disk.Free();
  EXPECT_TRUE(store->CreateMap(Spec(TrajectoryCodec::kQuantized)).ok());
  EXPECT_EQ(OrDie(store->ListMaps()).size(), 1u);
}

TEST(FullDisk, IsReadByAReaderThatComesLater) {
  SmallDisk disk;
  if (!disk.why_not().empty()) GTEST_SKIP() << disk.why_not();
  const auto store = OrDie(GraphStore::Open(disk.path(), {}));
  ASSERT_TRUE(store->CreateMap(Spec(TrajectoryCodec::kQuantized)).ok());
  auto writer = OrDie(store->OpenWriter(kMap));
  for (int64_t s = 1; s <= 3; ++s) ASSERT_TRUE(writer->Commit(DeltaOfStream({}, s)).ok());
  disk.Fill(0);
  const auto reader = store->OpenMap(kMap);
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_TRUE(Dump(*OrDie((*reader)->Latest())).ok());
}

}  // namespace
}  // namespace dsg::test
