// SPDX-License-Identifier: Apache-2.0
// A year of a robot's life kept in one map: with the default policy the file stops growing once
// everything that a policy waits for has come of age, without it never; and questions about today
// take as long at the end as at the beginning.
//
// DSG_DAYS days (30 by default; ages of the policies shrink with it, so that they come of age in
// time), DSG_YEAR_PNG where to draw the curves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "schema/retention/policy_file.h"
#include "tests/e2e/year/year_picture.h"
#include "tests/e2e/year/year_questions.h"
#include "tests/e2e/year/year_store.h"
#include "tests/e2e/year/year_world.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

constexpr double kMebibyte = 1024.0 * 1024.0;
// The ages of the default policy are for years: they need so many days to show what they do.
constexpr int kFullYear = 365;
constexpr int kQuestionRepeats = 9;
// Rounds in turn in which the young map and the old one are compared, and repeats in each: both
// meet the same moments of a busy machine.
constexpr int kDuelRounds = 31;
constexpr int kDuelRepeats = 3;

// With ages so much shorter as the year is.
std::vector<PrunePolicy> DefaultPolicies(int day_count) {
  std::vector<PrunePolicy> policies =
      OrDie(ReadPolicyFile(std::string(DSG_SOURCE_DIR) + "/docs/examples/long_term.yaml")).policies;
  const auto shrink = [&](TimeNs* age_ns) {
    *age_ns = std::max(kDayNs, *age_ns / kFullYear * std::min(day_count, kFullYear));
  };
  for (PrunePolicy& policy : policies) {
    if (auto* age = std::get_if<PrunePolicy::OlderThan>(&policy.what)) shrink(&age->age_ns);
    if (auto* age = std::get_if<PrunePolicy::UnseenFor>(&policy.what)) shrink(&age->age_ns);
    if (auto* age = std::get_if<PrunePolicy::HistoryOlderThan>(&policy.what)) shrink(&age->age_ns);
  }
  return policies;
}

// What one map was like at the end of each day.
struct Year {
  std::vector<double> file_mib;
  std::vector<double> pose_millions;
  std::vector<double> round_ms;
  std::string slowest;
};

// A map as it was at the end of a day, to be asked beside an older one.
struct YoungMap {
  explicit YoungMap(int day_number) : day(day_number) {}

  const int day;
  TempFolder folder;
  YearWorld world{{}};
  std::unique_ptr<query::ServiceCore> core;
};

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double MedianOfDays(const std::vector<double>& values, size_t from, size_t to) {
  return Median({values.begin() + static_cast<std::ptrdiff_t>(from),
                 values.begin() + static_cast<std::ptrdiff_t>(to)});
}

absl::Status LiveADay(const YearWorld& world, const std::vector<GraphDelta>& parts, int day,
                      YearStore* store, Year* year) {
  for (const GraphDelta& part : parts) DSG_RETURN_IF_ERROR(store->Commit(part));
  DSG_RETURN_IF_ERROR(store->Forget(day));
  DSG_ASSIGN_OR_RETURN(const YearLatency latency,
                       AskTheDay(store->core(), world, YearStore::kMap, day, kQuestionRepeats));
  DSG_ASSIGN_OR_RETURN(const int64_t pose_count, store->PoseCount());
  year->file_mib.push_back(static_cast<double>(store->FileBytes()) / kMebibyte);
  year->pose_millions.push_back(static_cast<double>(pose_count) * 1e-6);
  year->round_ms.push_back(latency.round_us * 1e-3);
  year->slowest = latency.slowest;
  return absl::OkStatus();
}

absl::Status Keep(const YearStore& store, YoungMap* young) {
  DSG_RETURN_IF_ERROR(store.CopyTo(young->folder.path()));
  for (int day = 0; day <= young->day; ++day) young->world.Day(day);
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<GraphStore> copy,
                       GraphStore::Open(young->folder.path(), {}));
  young->core = query::MakeServiceCore(std::move(copy));
  return absl::OkStatus();
}

// How many times as long a round of questions about the last day takes as one about the young
// map's last day: the median of rounds asked in turn.
absl::StatusOr<double> AgeingOf(const YoungMap& young, query::ServiceCore* old_core,
                                const YearWorld& old_world, int last_day) {
  std::vector<double> ratios;
  for (int i = 0; i < kDuelRounds; ++i) {
    DSG_ASSIGN_OR_RETURN(
        const YearLatency before,
        AskTheDay(young.core.get(), young.world, YearStore::kMap, young.day, kDuelRepeats));
    DSG_ASSIGN_OR_RETURN(const YearLatency now,
                         AskTheDay(old_core, old_world, YearStore::kMap, last_day, kDuelRepeats));
    ratios.push_back(now.round_us / before.round_us);
  }
  return Median(std::move(ratios));
}

void PrintDay(size_t day, const Year& kept, const Year& forgotten) {
  std::printf(
      "day %3zu: %7.1f MiB %5.2f M poses %6.2f ms a round | with the policy %7.1f MiB %5.2f M "
      "poses %6.2f ms a round (most: %s)\n",
      day, kept.file_mib[day], kept.pose_millions[day], kept.round_ms[day], forgotten.file_mib[day],
      forgotten.pose_millions[day], forgotten.round_ms[day], forgotten.slowest.c_str());
  std::fflush(stdout);
}

void Draw(const Year& kept, const Year& forgotten) {
  const char* path = std::getenv("DSG_YEAR_PNG");
  if (path == nullptr) return;
  constexpr uint32_t kKept = 0xc05030;
  constexpr uint32_t kForgotten = 0x2060b0;
  const auto panel = [&](const std::string& title, const auto& of) {
    return Panel{title,
                 {{"nothing forgotten", kKept, of(kept)},
                  {"docs/examples/long_term.yaml daily", kForgotten, of(forgotten)}}};
  };
  std::ofstream(path, std::ios::binary) << OrDie(DrawYear(
      {panel("Database and log of the map, MiB", [](const Year& year) { return year.file_mib; }),
       panel("Poses, millions", [](const Year& year) { return year.pose_millions; }),
       panel("One round of 13 kinds of questions, ms of processor time",
             [](const Year& year) { return year.round_ms; })}));
}

TEST(Year, StopsGrowingWithTheDefaultPolicyAndStaysAsQuick) {
  const auto day_count = static_cast<int>(EnvNumber("DSG_DAYS", 30));
  ASSERT_GE(day_count, 20);
  YearWorld world({});
  TempFolder kept_folder;
  TempFolder forgotten_folder;
  YearStore kept_store(kept_folder.path(), {});
  YearStore forgotten_store(forgotten_folder.path(), DefaultPolicies(day_count));
  const auto days = static_cast<size_t>(day_count);
  const size_t span = std::max<size_t>(3, days / 12);
  YoungMap young(static_cast<int>(2 * span) - 1);
  Year kept;
  Year forgotten;
  ASSERT_TRUE(kept_store.Commit(world.Building()).ok());
  ASSERT_TRUE(forgotten_store.Commit(world.Building()).ok());
  for (int day = 0; day < day_count; ++day) {
    const std::vector<GraphDelta> parts = world.Day(day);
    absl::Status status = LiveADay(world, parts, day, &kept_store, &kept);
    ASSERT_TRUE(status.ok()) << "day " << day << ": " << status;
    status = LiveADay(world, parts, day, &forgotten_store, &forgotten);
    ASSERT_TRUE(status.ok()) << "day " << day << ", with the policy: " << status;
    if (day == young.day) {
      status = Keep(forgotten_store, &young);
      ASSERT_TRUE(status.ok()) << status;
    }
    if (day % std::max(1, day_count / 15) == 0 || day + 1 == day_count) {
      PrintDay(static_cast<size_t>(day), kept, forgotten);
    }
  }
  Draw(kept, forgotten);

  // The oldest age of the policies is half a year.
  const size_t warm = days * 6 / 10;
  const double warm_mib = MedianOfDays(forgotten.file_mib, warm, warm + span);
  const double end_mib = MedianOfDays(forgotten.file_mib, days - span, days);
  std::printf("with the policy: %.1f MiB after warm-up, %.1f MiB at the end (%.2fx)\n", warm_mib,
              end_mib, end_mib / warm_mib);
  EXPECT_LT(end_mib, 1.1 * warm_mib) << "it still grows";
  const double half_mib = MedianOfDays(kept.file_mib, days / 2 - span, days / 2);
  const double whole_mib = MedianOfDays(kept.file_mib, days - span, days);
  std::printf("without: %.1f MiB at half-time, %.1f MiB at the end (%.2fx)\n", half_mib, whole_mib,
              whole_mib / half_mib);
  // Both hold the log too, which does not grow.
  EXPECT_GT(whole_mib, 1.3 * half_mib) << "nothing shows that the policy does anything";
  const double ageing = OrDie(AgeingOf(young, forgotten_store.core(), world, day_count - 1));
  std::printf("a round of questions at the end takes %.2f times as long as on day %d\n", ageing,
              young.day);
  EXPECT_LT(ageing, 1.2);
  for (const YearStore* store : {&kept_store, &forgotten_store}) {
    for (const std::string& problem : OrDie(store->Verify()).problems) ADD_FAILURE() << problem;
  }
}

}  // namespace
}  // namespace dsg::test
