// SPDX-License-Identifier: Apache-2.0
// Writers killed at random moments, over and over: nothing acknowledged is lost, nothing is seen by
// halves, and what the survivors finish equals what an undisturbed writer writes.
//
// DSG_KILLS kills a case, 25 by default; DSG_SEED repeats a run, as far as moments can be repeated.
#include <gtest/gtest.h>
#include <sched.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "tests/crash/people_log.h"
#include "tests/crash/process.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

// Waits so short that no clock interrupt would be fine enough.
void SpinFor(int64_t ns) {
  for (const int64_t end = SteadyNs() + ns; SteadyNs() < end;) sched_yield();
}

std::unique_ptr<GraphStore> OpenStore(const std::string& folder) {
  StoreOptions options;
  options.create = true;
  return OrDie(GraphStore::Open(folder, options));
}

// Digests of all revisions, oldest first; empty when there is no map yet.
std::vector<Sha256> ReadDigests(const std::string& folder) {
  const auto map = OpenStore(folder)->OpenMap(kMap);
  if (ReasonOf(map.status()) == Reason::kMapUnknown) return {};
  const auto revisions = OrDie(OrDie(map)->ListRevisions(0, 1'000'000));
  std::vector<Sha256> digests;
  for (auto it = revisions.rbegin(); it != revisions.rend(); ++it) {
    EXPECT_EQ(it->revision, static_cast<Revision>(digests.size() + 1)) << "revisions not dense";
    digests.push_back(it->digest);
  }
  return digests;
}

std::string Problems(const std::string& folder) {
  const auto map = OpenStore(folder)->OpenMap(kMap);
  if (ReasonOf(map.status()) == Reason::kMapUnknown) return "";
  std::string text;
  for (const std::string& problem : OrDie(OrDie(map)->Verify({}, {})).problems)
    text += problem + "\n";
  return text;
}

std::string DumpOf(const std::string& folder) {
  std::string text = OrDie(Dump(*OrDie(OrDie(OpenStore(folder)->OpenMap(kMap))->Latest())));
  // Commits happen at other moments in another run.
  return text.substr(text.find("ScanNodes:"));
}

// What was true after all kills of one case.
struct Totals {
  int kill_count = 0;
  int run_count = 0;
  int finished_count = 0;
  int before_any_revision_count = 0;
  int64_t acknowledged_count = 0;
  int64_t unacknowledged_count = 0;

  void Print(const char* what) const {
    std::printf(
        "%s: %d kills in %d runs over %d stores, %d before the first revision; %lld "
        "revisions acknowledged before a kill, 0 lost; %lld found beyond the last "
        "acknowledged\n",
        what, kill_count, run_count, finished_count, before_any_revision_count,
        static_cast<long long>(acknowledged_count), static_cast<long long>(unacknowledged_count));
  }
};

// The store after a run that began with `committed` revisions: at least `acknowledged` of them, all
// equal to the oracle's. Returns how many there are.
Revision CheckSurvivor(const std::string& folder, const std::vector<Sha256>& oracle,
                       Revision committed, Revision acknowledged, Totals* totals) {
  const std::vector<Sha256> found = ReadDigests(folder);
  const auto found_count = static_cast<Revision>(found.size());
  EXPECT_GE(found_count, acknowledged) << "an acknowledged revision is lost";
  EXPECT_LE(found.size(), oracle.size());
  for (size_t i = 0; i < std::min(found.size(), oracle.size()); ++i) {
    EXPECT_EQ(ToHex(found[i]), ToHex(oracle[i])) << "revision " << i + 1;
  }
  EXPECT_EQ(Problems(folder), "");
  totals->acknowledged_count += acknowledged - committed;
  totals->unacknowledged_count += found_count - acknowledged;
  if (found_count == 0) ++totals->before_any_revision_count;
  return found_count;
}

// ---- The program dsg-ingest, watched from outside.

class IngestRig {
 public:
  IngestRig() {
    std::ofstream(log_path()) << PeopleLog(7, 20'000);
    for (const bool has_rooms : {false, true}) {
      const std::string folder = NewStore(has_rooms);
      Process program = Start(folder);
      EXPECT_EQ(program.Wait().exit_code, 0) << Output();
      oracles_[has_rooms] = ReadDigests(folder);
      dumps_[has_rooms] = DumpOf(folder);
      EXPECT_GE(oracles_[has_rooms].size(), 100u);
      EXPECT_EQ(Problems(folder), "");
    }
  }

  static std::string program() { return std::string(DSG_BINARY_DIR) + "/dsg-ingest"; }
  const std::vector<Sha256>& oracle(bool has_rooms) const { return oracles_[has_rooms]; }
  const std::string& dump(bool has_rooms) const { return dumps_[has_rooms]; }
  std::string log_path() const { return folder_.path() + "/people.txt"; }
  std::string Output() const { return ReadFile(folder_.path() + "/output"); }

  /// A store without a map, or with a map that has rooms and places already.
  std::string NewStore(bool has_rooms) {
    const std::string folder = absl::StrCat(folder_.path(), "/store-", store_count_++);
    const auto store = OpenStore(folder);
    if (has_rooms) {
      EXPECT_TRUE(store->CreateMap(Spec(TrajectoryCodec::kQuantized)).ok());
      EXPECT_TRUE(OrDie(store->OpenWriter(kMap))->Commit(DeltaOfStream({}, 1)).ok());
    }
    return folder;
  }

  Process Start(const std::string& folder) const {
    return Process::Run({program(), "--store", folder, "--map", kMap, "--format", "trajnet",
                         "--commit-poses", "200", "--quiet", log_path()},
                        folder_.path() + "/output");
  }

 private:
  TempFolder folder_;
  int store_count_ = 0;
  std::vector<Sha256> oracles_[2];
  std::string dumps_[2];
};

// Watches the map until it has `target` revisions or the program has ended; the newest seen.
Revision WatchUntil(const std::string& folder, Revision target, Process* program) {
  const auto store = OpenStore(folder);
  std::shared_ptr<MapReader> map;
  Revision seen = 0;
  while (seen < target && !program->HasEnded()) {
    if (map == nullptr) {
      if (auto opened = store->OpenMap(kMap); opened.ok()) map = *std::move(opened);
    } else {
      seen = OrDie(map->Head()).revision;
    }
    sched_yield();
  }
  return seen;
}

// One run until it is killed, or until it is done; false when it was done.
bool RunAndKill(const IngestRig& rig, const std::string& folder, Revision at_least,
                std::mt19937_64* random, Revision* acknowledged) {
  Process program = rig.Start(folder);
  if ((*random)() % 5 == 0) {
    // Early: while the log is read, the map made or opened, the first revision written.
    SpinFor(static_cast<int64_t>((*random)() % 60'000'000));
    *acknowledged = at_least;
  } else {
    const Revision target = at_least + 1 + static_cast<Revision>((*random)() % 12);
    *acknowledged = std::max(at_least, WatchUntil(folder, target, &program));
    SpinFor(static_cast<int64_t>((*random)() % 5'000'000));
  }
  program.Kill();
  const Process::Ending ending = program.Wait();
  EXPECT_TRUE(ending.killed || ending.exit_code == 0) << rig.Output();
  return ending.killed;
}

TEST(KilledIngest, LosesNothingAndEndsLikeAnUndisturbedOne) {
  if (!std::filesystem::exists(IngestRig::program())) {
    GTEST_SKIP() << "dsg-ingest is not built";
  }
  const int64_t kill_target = EnvNumber("DSG_KILLS", 25);
  std::mt19937_64 random(RecordSeed());
  IngestRig rig;
  Totals totals;
  while (totals.kill_count < kill_target && !testing::Test::HasFailure()) {
    const bool has_rooms = totals.finished_count % 2 == 1;
    const std::string folder = rig.NewStore(has_rooms);
    Revision committed = has_rooms ? 1 : 0;
    for (bool is_done = false; !is_done && !testing::Test::HasFailure();) {
      Revision acknowledged = 0;
      ++totals.run_count;
      if (totals.kill_count >= kill_target) {
        Process last = rig.Start(folder);
        EXPECT_EQ(last.Wait().exit_code, 0) << rig.Output();
        is_done = true;
      } else {
        is_done = !RunAndKill(rig, folder, committed, &random, &acknowledged);
        if (!is_done) ++totals.kill_count;
      }
      // Exit code 0 acknowledges the whole log.
      if (is_done) acknowledged = static_cast<Revision>(rig.oracle(has_rooms).size());
      committed = CheckSurvivor(folder, rig.oracle(has_rooms), committed,
                                std::max(acknowledged, committed), &totals);
    }
    EXPECT_EQ(static_cast<size_t>(committed), rig.oracle(has_rooms).size());
    EXPECT_TRUE(DumpOf(folder) == rig.dump(has_rooms)) << "other answers than undisturbed";
    ++totals.finished_count;
  }
  totals.Print("dsg-ingest");
  EXPECT_GE(totals.kill_count, kill_target);
}

// ---- A child of this very program, which says what was acknowledged.

// Large enough that the log is copied back to the database in the middle of a run.
DeltaStreamOptions HeavyStream() {
  DeltaStreamOptions options;
  options.seed = 5;
  options.mesh_vertex_count = 20'000;
  options.asset_bytes = 1'500'000;
  return options;
}

constexpr int64_t kStreamLength = 96;

void WriteStream(const std::string& folder, const std::function<void(int64_t)>& acknowledge) {
  const auto store = OpenStore(folder);
  // A run before this one may have made the map.
  if (OrDie(store->ListMaps()).empty()) {
    OrDie(store->CreateMap(Spec(TrajectoryCodec::kLossless)));
  }
  const auto writer = OrDie(store->OpenWriter(kMap));
  const std::string session = DeltaOfStream(HeavyStream(), 1).session_id;
  int64_t sequence = OrDie(writer->GetSession(session)).last_sequence;
  while (++sequence <= kStreamLength) {
    acknowledge(OrDie(writer->Commit(DeltaOfStream(HeavyStream(), sequence))).revision);
  }
}

// One run until it is killed, or until it is done; false when it was done.
bool ForkAndKill(const std::string& folder, std::mt19937_64* random, Revision* acknowledged) {
  Process child = Process::Fork([&](const auto& report) { WriteStream(folder, report); });
  const auto hear = [&](const std::optional<Acknowledgement>& ack) {
    if (ack.has_value()) *acknowledged = ack->revision;
    return ack.has_value();
  };
  const int awaited = static_cast<int>((*random)() % 14);
  for (int i = 0; i < awaited && hear(child.NextAcknowledgement()); ++i) {
  }
  SpinFor(static_cast<int64_t>((*random)() % (awaited == 0 ? 30'000'000 : 8'000'000)));
  child.Kill();
  const Process::Ending ending = child.Wait();
  while (hear(child.NextAcknowledgement())) {
  }
  EXPECT_TRUE(ending.killed || ending.exit_code == 0);
  return ending.killed;
}

TEST(KilledWriter, LosesNoAcknowledgedRevisionAndEndsLikeAnUndisturbedOne) {
  const int64_t kill_target = EnvNumber("DSG_KILLS", 25);
  std::mt19937_64 random(RecordSeed());
  TempFolder folder;
  const std::string undisturbed = folder.path() + "/undisturbed";
  Process child = Process::Fork([&](const auto& report) { WriteStream(undisturbed, report); });
  ASSERT_EQ(child.Wait().exit_code, 0);
  const std::vector<Sha256> oracle = ReadDigests(undisturbed);
  ASSERT_EQ(oracle.size(), static_cast<size_t>(kStreamLength));
  Totals totals;
  while (totals.kill_count < kill_target && !testing::Test::HasFailure()) {
    const std::string store = absl::StrCat(folder.path(), "/store-", totals.finished_count);
    Revision committed = 0;
    for (bool is_done = false; !is_done && !testing::Test::HasFailure();) {
      Revision acknowledged = committed;
      ++totals.run_count;
      if (totals.kill_count >= kill_target) {
        Process last = Process::Fork([&](const auto& report) { WriteStream(store, report); });
        EXPECT_EQ(last.Wait().exit_code, 0);
        is_done = true;
      } else {
        is_done = !ForkAndKill(store, &random, &acknowledged);
        if (!is_done) ++totals.kill_count;
      }
      if (is_done) acknowledged = kStreamLength;
      if (!std::filesystem::exists(store)) continue;
      committed = CheckSurvivor(store, oracle, committed, acknowledged, &totals);
      // The commit that was under way may have made it; no other can.
      if (!is_done) {
        EXPECT_LE(committed, acknowledged + 1);
      }
    }
    EXPECT_EQ(committed, kStreamLength);
    EXPECT_TRUE(DumpOf(store) == DumpOf(undisturbed)) << "other answers than undisturbed";
    ++totals.finished_count;
  }
  totals.Print("library writer");
  EXPECT_GE(totals.kill_count, kill_target);
}

}  // namespace
}  // namespace dsg::test
