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

// A disk in memory. Mounting takes root; without it, `why_not` says so.
class SmallDisk {
 public:
  explicit SmallDisk(const char* size = "size=6m") {
    if (mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, size) != 0) {
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
    EXPECT_TRUE(OrDie(reader->Verify({}, {})).problems.empty());
    disk.Free();
    for (const int64_t stop = sequence + 3; sequence < stop; ++sequence) {
      const auto committed = writer->Commit(DeltaOfStream(options, sequence));
      ASSERT_TRUE(committed.ok()) << committed.status();
      EXPECT_EQ(committed->revision, sequence);
    }
  }
  EXPECT_TRUE(OrDie(reader->Verify({}, {})).problems.empty());
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

// A map with some history on a disk of 16 MiB, with a reserve of 2 MiB.
class FullDiskWithReserve : public testing::Test {
 protected:
  void SetUp() override {
    if (!disk_.why_not().empty()) GTEST_SKIP() << disk_.why_not();
    StoreOptions options;
    options.reserve_bytes = 2 << 20;
    store_ = OrDie(GraphStore::Open(disk_.path(), options));
    ASSERT_TRUE(store_->CreateMap(Spec(TrajectoryCodec::kQuantized)).ok());
    writer_ = OrDie(store_->OpenWriter(kMap));
    reader_ = OrDie(store_->OpenMap(kMap));
    stream_.asset_bytes = 50'000;
    for (int64_t s = 1; s <= 40; ++s) OrDie(writer_->Commit(DeltaOfStream(stream_, s)));
  }

  // The disk is full, and the head says what it said.
  void Fill(size_t spare_bytes) {
    disk_.Fill(spare_bytes);
    absl::Status failure;
    next_ = CommitUntilFull(writer_.get(), next_, stream_, &failure);
    ASSERT_EQ(ReasonOf(failure), Reason::kDiskFull) << failure;
    ASSERT_TRUE(HasReserve()) << "a plain commit took the reserve";
    disk_.Fill(0);
    said_ = OrDie(Dump(*OrDie(reader_->Latest())));
  }
  bool HasReserve() const {
    return std::filesystem::exists(absl::StrCat(disk_.path(), "/", kMap, "/reserve"));
  }
  GraphDelta Forget(std::vector<NodeId> nodes) {
    GraphDelta delta;
    delta.session_id = "prune";
    delta.sequence = ++prune_count_;
    for (const NodeId id : nodes) delta.retirements.push_back({id, std::nullopt});
    delta.is_forgetting = true;
    return delta;
  }
  void ExpectSound() {
    EXPECT_TRUE(OrDie(OrDie(store_->OpenMap(kMap))->Verify({}, {})).problems.empty());
  }
  void ExpectGoesOnWithSpace() {
    disk_.Free();
    OrDie(writer_->Commit(Forget({})));
    EXPECT_TRUE(HasReserve());
    OrDie(writer_->Commit(DeltaOfStream(stream_, next_)));
    ExpectSound();
  }

  SmallDisk disk_{"size=16m"};
  DeltaStreamOptions stream_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<MapWriter> writer_;
  std::shared_ptr<MapReader> reader_;
  std::string said_;
  int64_t next_ = 41;
  int64_t prune_count_ = 0;
};

TEST_F(FullDiskWithReserve, LetsRetiringCommitsThrough) {
  ASSERT_NO_FATAL_FAILURE(Fill(0));
  GraphDelta delta = Forget({NodeId('O', 5)});
  delta.is_forgetting = false;
  EXPECT_EQ(ReasonOf(writer_->Commit(delta).status()), Reason::kDiskFull);
  delta.is_forgetting = true;
  const auto committed = writer_->Commit(delta);
  ASSERT_TRUE(committed.ok()) << committed.status();
  EXPECT_EQ(OrDie(reader_->Head()).revision, next_);
  EXPECT_EQ(ReasonOf(OrDie(reader_->Latest())->GetNode(NodeId('O', 5)).status()),
            Reason::kNodeUnknown);
  ExpectSound();
  ExpectGoesOnWithSpace();
}

// More than the reserve holds, were the log of all of it kept.
TEST_F(FullDiskWithReserve, LetsALongSeriesOfRetiringCommitsThrough) {
  ASSERT_NO_FATAL_FAILURE(Fill(0));
  for (int i = 0; i < 400; ++i) {
    const auto committed = writer_->Commit(Forget({}));
    ASSERT_TRUE(committed.ok()) << "commit " << i << ": " << committed.status();
  }
  EXPECT_FALSE(HasReserve());
  writer_.reset();
  ExpectSound();
  writer_ = OrDie(store_->OpenWriter(kMap));
  ExpectGoesOnWithSpace();
}

TEST_F(FullDiskWithReserve, LetsCompactionFreeSpace) {
  for (const size_t spare_bytes : {size_t{0}, size_t{20'000}, size_t{60'000}}) {
    SCOPED_TRACE(absl::StrCat("spare bytes ", spare_bytes));
    ASSERT_NO_FATAL_FAILURE(Fill(spare_bytes));
    const Revision head = OrDie(reader_->Head()).revision;
    const auto compacted = writer_->Compact(head, {}, {});
    ASSERT_TRUE(compacted.ok()) << compacted.status();
    EXPECT_TRUE(compacted->is_shrunk);
    EXPECT_LT(compacted->bytes_after, compacted->bytes_before);
    EXPECT_EQ(OrDie(Dump(*OrDie(reader_->Latest()))), said_);
    ExpectSound();
    disk_.Free();
    OrDie(writer_->Commit(Forget({})));
    for (const int64_t stop = next_ + 20; next_ < stop; ++next_) {
      OrDie(writer_->Commit(DeltaOfStream(stream_, next_)));
    }
  }
}

TEST_F(FullDiskWithReserve, LetsErasingFreeSpace) {
  ASSERT_NO_FATAL_FAILURE(Fill(0));
  std::vector<NodeId> nodes = {NodeId('H', 3)};
  for (uint64_t i = 0; i < 20; ++i) nodes.push_back(NodeId('O', i));
  ASSERT_TRUE(writer_->Commit(Forget(nodes)).ok());
  const auto report = writer_->Erase({.nodes = nodes, .assets = true}, {}, {});
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_GT(report->asset_count, 1);
  EXPECT_TRUE(report->is_clean);
  EXPECT_LT(report->bytes_after, report->bytes_before);
  reader_ = OrDie(store_->OpenMap(kMap));
  EXPECT_EQ(ReasonOf(OrDie(reader_->At(20))->GetNode(NodeId('O', 5)).status()),
            Reason::kNodeUnknown);
  // Agents that left the stream take no more poses.
  disk_.Free();
  ExpectSound();
  OrDie(writer_->Commit(Forget({})));
  EXPECT_TRUE(HasReserve());
}

TEST_F(FullDiskWithReserve, MakesNoHalfCopyAndInstallsNone) {
  const std::string folder = absl::StrCat(disk_.path(), "/away");
  std::filesystem::create_directory(folder);
  for (const size_t spare_bytes : {size_t{0}, size_t{30'000}, size_t{200'000}}) {
    disk_.Fill(spare_bytes);
    const absl::Status copied = reader_->CopyTo(folder + "/copy", {}, {});
    EXPECT_EQ(ReasonOf(copied), Reason::kDiskFull) << copied;
    EXPECT_TRUE(std::filesystem::is_empty(folder));
    disk_.Free();
  }
  ASSERT_TRUE(reader_->CopyTo(folder + "/copy", {}, {}).ok());
  disk_.Fill(0);
  const absl::Status installed = store_->InstallMap("other", folder + "/copy", false);
  if (!installed.ok()) {
    EXPECT_EQ(ReasonOf(installed), Reason::kDiskFull) << installed;
    disk_.Free();
    ASSERT_TRUE(store_->InstallMap("other", folder + "/copy", false).ok());
  }
  EXPECT_TRUE(OrDie(OrDie(store_->OpenMap("other"))->Verify({}, {})).problems.empty());
  ExpectSound();
}

TEST(Quota, RefusesCommitsThatGrowAMapAndLetsItForget) {
  TempFolder folder;
  StoreOptions options;
  options.quota_bytes = 1 << 20;
  const auto store = OrDie(GraphStore::Open(folder.path(), options));
  OrDie(store->CreateMap(Spec(TrajectoryCodec::kQuantized)));
  auto writer = OrDie(store->OpenWriter(kMap));
  const auto reader = OrDie(store->OpenMap(kMap));
  DeltaStreamOptions stream;
  stream.asset_bytes = 40'000;
  absl::Status failure;
  int64_t next = CommitUntilFull(writer.get(), 1, stream, &failure);
  EXPECT_EQ(ReasonOf(failure), Reason::kQuotaExceeded) << failure;
  EXPECT_EQ(failure.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(OrDie(reader->Head()).revision, next - 1);
  GraphDelta forget;
  forget.session_id = "prune";
  forget.sequence = 1;
  for (uint64_t i = 0; i < 24; i += 8) forget.retirements.push_back({NodeId('O', i), std::nullopt});
  forget.is_forgetting = true;
  ASSERT_TRUE(writer->Commit(forget).ok());
  forget.nodes.push_back(MakeObject(1, "new", BoxOf(0, 0, 0, 1, 1, 1)));
  EXPECT_EQ(ReasonOf(writer->Commit(forget).status()), Reason::kDeltaInvalid);
  OrDie(writer->Compact(OrDie(reader->Head()).revision, {}, {}));
  EXPECT_LE(OrDie(OrDie(reader->Latest())->Stats()).bytes_on_disk, options.quota_bytes);
  writer.reset();
  EXPECT_LE(std::filesystem::file_size(absl::StrCat(folder.path(), "/", kMap, "/graph.db")),
            static_cast<uint64_t>(options.quota_bytes));
  EXPECT_TRUE(OrDie(reader->Verify({}, {})).problems.empty());
}

}  // namespace
}  // namespace dsg::test
