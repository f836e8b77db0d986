// SPDX-License-Identifier: Apache-2.0
// Every operation on a map killed at random moments: the map stays sound, what was acknowledged is
// there, what the operation does not touch is what it was, and running it again ends it rightly.
//
// DSG_KILLS kills in all, 40 by default; DSG_SEED repeats a run, as far as moments can be repeated;
// DSG_ONLY names one operation.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "absl/strings/str_join.h"
#include "tests/crash/keep_operations.h"
#include "tests/crash/process.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

struct Tally {
  int kill_count = 0;
  int ended_before_count = 0;
  int violation_count = 0;
  double length_s = 0.0;
};

std::string OutputOf(const std::string& place) { return ReadFile(place + "/output"); }

// One operation, killed over and over.
class Killing {
 public:
  Killing(KeepRig* rig, const KeepOperation& operation, std::mt19937_64* random)
      : rig_(*rig), operation_(operation), random_(*random) {}

  const Tally& tally() const { return tally_; }

  /// How long it takes and how it ends when nobody disturbs it.
  void RunUndisturbed() {
    const std::string place = operation_.make_place(rig_);
    const int64_t begin_ns = SteadyNs();
    const int code = RunToEnd(operation_.command(rig_, place), place);
    length_ns_ = SteadyNs() - begin_ns;
    tally_.length_s = static_cast<double>(length_ns_) * 1e-9;
    ASSERT_EQ(code, 0) << operation_.name << ": " << OutputOf(place);
    const Aftermath after = Check(place, /*is_done=*/true, "undisturbed");
    const auto newest = after.main.dumps.find(after.main.newest);
    if (newest != after.main.dumps.end()) undisturbed_ = newest->second;
    fs::remove_all(place);
  }

  void KillOnce() {
    const std::string place = operation_.make_place(rig_);
    const std::vector<std::string> command = operation_.command(rig_, place);
    Process program = Process::Run(command, place + "/output");
    const int64_t moment_ns = Moment();
    std::this_thread::sleep_for(std::chrono::nanoseconds(moment_ns));
    program.Kill();
    const Process::Ending ending = program.Wait();
    if (!ending.killed) {
      // The machine was busier when the operation was timed.
      length_ns_ = moment_ns;
      ++tally_.ended_before_count;
      EXPECT_EQ(ending.exit_code, 0) << operation_.name << ": " << OutputOf(place);
    } else {
      ++tally_.kill_count;
    }
    Check(place, /*is_done=*/!ending.killed, "after a kill");
    if (ending.killed) {
      const bool is_ended = RunToEnd(command, place) == 0;
      const bool was_done = !operation_.done_reason.empty() &&
                            OutputOf(place).find(operation_.done_reason) != std::string::npos;
      if (!is_ended && !was_done) {
        ++tally_.violation_count;
        ADD_FAILURE() << operation_.name << " cannot be run again: " << OutputOf(place);
      }
      Check(place, /*is_done=*/true, "run again");
    }
    fs::remove_all(place);
  }

 private:
  // Starting a program takes a part of the time in which nothing can go wrong.
  int64_t Moment() {
    const auto from = static_cast<uint64_t>(length_ns_ / (random_() % 5 == 0 ? 100 : 4));
    return static_cast<int64_t>(from + random_() % (static_cast<uint64_t>(length_ns_) - from));
  }

  Aftermath Check(const std::string& place, bool is_done, const char* when) {
    std::string problems;
    Aftermath after = LookAt(rig_, operation_, place, is_done, &problems);
    after.undisturbed = undisturbed_;
    if (problems.empty()) problems += operation_.violation(after);
    if (!problems.empty()) {
      ++tally_.violation_count;
      ADD_FAILURE() << operation_.name << ", " << when << ": " << problems;
    }
    return after;
  }

  KeepRig& rig_;
  const KeepOperation& operation_;
  std::mt19937_64& random_;
  Tally tally_;
  int64_t length_ns_ = 0;
  std::string undisturbed_;
};

void PrintTable(const std::vector<std::pair<std::string, Tally>>& rows) {
  Tally sum;
  std::printf("%-16s %7s %12s %10s %8s\n", "operation", "kills", "ended before", "violations",
              "takes s");
  for (const auto& [name, tally] : rows) {
    std::printf("%-16s %7d %12d %10d %8.2f\n", name.c_str(), tally.kill_count,
                tally.ended_before_count, tally.violation_count, tally.length_s);
    sum.kill_count += tally.kill_count;
    sum.ended_before_count += tally.ended_before_count;
    sum.violation_count += tally.violation_count;
  }
  std::printf("%-16s %7d %12d %10d\n", "all", sum.kill_count, sum.ended_before_count,
              sum.violation_count);
}

TEST(KilledOperation, LeavesASoundMapAndIsEndedByRunningItAgain) {
  const int64_t kill_target = EnvNumber("DSG_KILLS", 40);
  const char* only = std::getenv("DSG_ONLY");
  std::mt19937_64 random(RecordSeed());
  KeepRig rig;
  std::vector<std::string> missing;
  std::vector<KeepOperation> operations = KeepOperations(&missing);
  if (only != nullptr) {
    std::erase_if(operations, [&](const KeepOperation& one) { return one.name != only; });
  }
  EXPECT_TRUE(missing.empty()) << "no verb for " << absl::StrJoin(missing, ", ");
  ASSERT_FALSE(operations.empty());
  std::vector<std::pair<std::string, Tally>> rows;
  const auto count = static_cast<int64_t>(operations.size());
  for (int64_t i = 0; i < count; ++i) {
    const int64_t share = kill_target * (i + 1) / count - kill_target * i / count;
    Killing killing(&rig, operations[static_cast<size_t>(i)], &random);
    killing.RunUndisturbed();
    // Short operations are over before they are killed now and then; not for ever.
    for (int64_t tries = 0; killing.tally().kill_count < share && tries < 4 * share; ++tries) {
      if (HasFatalFailure() || killing.tally().violation_count > 3) break;
      killing.KillOnce();
    }
    EXPECT_GE(killing.tally().kill_count, share) << operations[static_cast<size_t>(i)].name;
    rows.emplace_back(operations[static_cast<size_t>(i)].name, killing.tally());
  }
  PrintTable(rows);
}

// ---- What cannot fail proves nothing.

class PlantedViolation : public testing::Test {
 protected:
  PlantedViolation() : place_(rig_.MakePlace()) {
    std::vector<std::string> missing;
    operation_ = KeepOperations(&missing).front();
  }

  std::string Look() {
    std::string problems;
    Aftermath after = LookAt(rig_, operation_, place_, /*is_done=*/false, &problems);
    return problems.empty() ? operation_.violation(after) : problems;
  }

  std::string database() const { return place_ + "/store/office/graph.db"; }

  KeepRig rig_;
  std::string place_;
  KeepOperation operation_;
};

TEST_F(PlantedViolation, NoneIsSeenWhereThereIsNone) { EXPECT_EQ(Look(), ""); }

TEST_F(PlantedViolation, ALostAcknowledgedRevisionIsSeen) {
  // An older map in place of the one that was acknowledged.
  TestMap older(Spec(TrajectoryCodec::kQuantized));
  older.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  older.Close();
  fs::copy_file(older.database_path(), database(), fs::copy_options::overwrite_existing);
  EXPECT_NE(Look(), "");
}

TEST_F(PlantedViolation, AFlippedBitIsSeen) {
  std::fstream file(database(), std::ios::in | std::ios::out | std::ios::binary);
  const auto middle = static_cast<std::streamoff>(fs::file_size(database()) / 2);
  file.seekg(middle);
  const int byte = file.get();
  file.seekp(middle);
  file.put(static_cast<char>(byte ^ 4));
  file.close();
  EXPECT_NE(Look(), "");
}

TEST_F(PlantedViolation, ALostTagIsSeen) {
  {
    const auto store = OrDie(GraphStore::Open(place_ + "/store", {}));
    OrDie(OrDie(store->OpenWriter("office"))->RemoveTag(KeepRig::kTag));
  }
  EXPECT_NE(Look().find("tag"), std::string::npos);
}

TEST_F(PlantedViolation, AChangeOfTheOtherMapIsSeen) {
  fs::remove_all(place_ + "/store/annex");
  EXPECT_NE(Look().find("other map"), std::string::npos);
}

}  // namespace
}  // namespace dsg::test
