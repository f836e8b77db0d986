// SPDX-License-Identifier: Apache-2.0
// Erasures killed at random moments, each followed by another one: what says "erased" tells the
// truth of all that was begun, and what is left is shown.
//
// DSG_KILLS kills, 20 by default; DSG_SEED repeats a run, as far as moments can be repeated.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <random>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "tests/crash/keep_operations.h"
#include "tests/crash/process.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

constexpr int kThingCount = 3'000;

// In rooms R1 and R2; the names say in which.
std::string SecretOf(int room) { return absl::StrCat("planted-secret-of-room-", room, "-"); }

void FillStore(const std::string& folder) {
  StoreOptions options;
  options.create = true;
  const auto store = OrDie(GraphStore::Open(folder, options));
  OrDie(store->CreateMap(Spec(TrajectoryCodec::kQuantized)));
  const auto writer = OrDie(store->OpenWriter(kMap));
  GraphDelta delta;
  delta.map = kMap;
  delta.session_id = "world";
  for (const int room : {1, 2}) {
    Node node;
    node.id = NodeId('R', static_cast<uint64_t>(room));
    node.layer = layers::kRooms;
    node.kind = kinds::kRoom;
    node.name = SecretOf(room);
    delta.nodes.push_back(node);
    for (int i = 0; i < kThingCount; ++i) {
      node.id = NodeId('O', static_cast<uint64_t>(room * kThingCount + i));
      node.layer = layers::kObjects;
      node.kind = kinds::kObject;
      node.name = absl::StrCat(SecretOf(room), i);
      delta.nodes.push_back(node);
      delta.edges.push_back(
          {NodeId('R', static_cast<uint64_t>(room)), relations::kContains, node.id});
    }
  }
  delta.sequence = 1;
  OrDie(writer->Commit(delta));
  // Something of the past, too.
  for (Node& node : delta.nodes) node.observation_count = 2;
  delta.sequence = 2;
  OrDie(writer->Commit(delta));
}

bool StoreHolds(const std::string& store, const std::string& text) {
  return absl::StrContains(ReadFolder(store), text);
}

class KilledErasure : public testing::Test {
 protected:
  KilledErasure() : random_(RecordSeed()) { FillStore(folder_.path() + "/template"); }

  std::string MakePlace() {
    const std::string place = absl::StrCat(folder_.path(), "/place");
    fs::remove_all(place);
    fs::create_directory(place);
    fs::copy(folder_.path() + "/template", place + "/store", fs::copy_options::recursive);
    return place;
  }

  static std::vector<std::string> EraseRoom(const std::string& place, int room) {
    return {DSG_BINARY_DIR "/dsg",
            "prune",
            "--store",
            place + "/store",
            "--map",
            kMap,
            "--json",
            "--branch",
            absl::StrCat("R", room),
            "--erase",
            "--yes"};
  }

  static std::string OutputOf(const std::string& place) { return ReadFile(place + "/output"); }

  // Its output alone, in the place. The exit code.
  static int RunAlone(const std::vector<std::string>& command, const std::string& place) {
    fs::remove(place + "/output");
    return RunToEnd(command, place);
  }

  // Whether it came to its end, and said that all is erased.
  static bool SaysErased(const std::vector<std::string>& command, const std::string& place) {
    const bool is_ended = RunAlone(command, place) == 0;
    return is_ended && absl::StrContains(OutputOf(place), "\"erased\": true");
  }

  static bool IsPending(const std::string& place) {
    EXPECT_EQ(RunAlone({DSG_BINARY_DIR "/dsg", "stats", "--store", place + "/store", "--map", kMap,
                        "--json"},
                       place),
              0);
    return absl::StrContains(OutputOf(place), "pending_erasure");
  }

  // Whether the newest revision has the room.
  static bool IsBelieved(const std::string& place, int room) {
    const auto store = OrDie(GraphStore::Open(place + "/store", {}));
    const auto map = OrDie(store->OpenMap(kMap));
    return OrDie(map->Latest())->GetNode(NodeId('R', static_cast<uint64_t>(room))).ok();
  }

  static void ExpectSound(const std::string& place, bool is_pending) {
    const auto store = OrDie(GraphStore::Open(place + "/store", {}));
    const VerifyReport report = OrDie(OrDie(store->OpenMap(kMap))->Verify({}, {}));
    EXPECT_TRUE(report.problems.empty()) << report.problems.front();
    EXPECT_EQ(report.notes.empty(), !is_pending);
  }

  TempFolder folder_;
  std::mt19937_64 random_;
};

TEST_F(KilledErasure, IsRememberedUntilItEndsWhateverOthersErase) {
  const int64_t kill_target = EnvNumber("DSG_KILLS", 20);
  const std::string first = MakePlace();
  const int64_t begin_ns = SteadyNs();
  ASSERT_TRUE(SaysErased(EraseRoom(first, 1), first)) << OutputOf(first);
  const int64_t length_ns = SteadyNs() - begin_ns;
  ASSERT_FALSE(StoreHolds(first + "/store", SecretOf(1)));
  ASSERT_TRUE(StoreHolds(first + "/store", SecretOf(2)));

  int kill_count = 0;
  int pending_count = 0;
  int pending_after_other_count = 0;
  int ended_by_other_count = 0;
  for (int tries = 0; kill_count < kill_target && tries < 4 * kill_target; ++tries) {
    if (HasFailure()) break;
    SCOPED_TRACE(absl::StrCat("try ", tries));
    const std::string place = MakePlace();
    Process program = Process::Run(EraseRoom(place, 1), place + "/output");
    std::this_thread::sleep_for(
        std::chrono::nanoseconds(random_() % static_cast<uint64_t>(length_ns)));
    program.Kill();
    if (!program.Wait().killed) continue;
    ++kill_count;
    const bool was_pending = IsPending(place);
    pending_count += was_pending ? 1 : 0;
    // Once its room is not believed any more, an erasure was begun.
    const bool was_begun = !IsBelieved(place, 1);
    EXPECT_TRUE(was_pending || !was_begun || !StoreHolds(place + "/store", SecretOf(1)));

    const bool says_erased = SaysErased(EraseRoom(place, 2), place);
    const std::string of_other = OutputOf(place);
    const bool is_pending = IsPending(place);
    EXPECT_EQ(says_erased, !is_pending);
    EXPECT_FALSE(StoreHolds(place + "/store", SecretOf(2)));
    if (was_pending && says_erased) {
      ++ended_by_other_count;
      EXPECT_FALSE(StoreHolds(place + "/store", SecretOf(1)));
    }
    pending_after_other_count += is_pending ? 1 : 0;
    ExpectSound(place, is_pending);

    // Of what is wholly gone nobody knows any more.
    const bool is_ended = SaysErased(EraseRoom(place, 1), place);
    const std::string of_same = OutputOf(place);
    EXPECT_TRUE(is_ended || absl::StrContains(of_same, "NODE_UNKNOWN")) << of_same;
    EXPECT_FALSE(StoreHolds(place + "/store", SecretOf(1)));
    EXPECT_FALSE(IsPending(place))
        << "the other said: " << of_other << "\nthe same again: " << of_same;
    ExpectSound(place, false);
  }
  EXPECT_GE(kill_count, kill_target);
  std::printf(
      "kills %d, pending after the kill %d, ended by another erasure %d, pending still"
      " after it %d\n",
      kill_count, pending_count, ended_by_other_count, pending_after_other_count);
}

}  // namespace
}  // namespace dsg::test
