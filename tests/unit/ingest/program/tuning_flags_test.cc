// SPDX-License-Identifier: Apache-2.0
// Every number of every stage: its flag, its range, its way into the options and into the session.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/config/option_flags.h"
#include "ingest/odometry/estimator/odometry_options.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/program/ingest_flags.h"
#include "ingest/program/odometry_flags.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/config/other_value.h"

namespace dsg::ingest {
namespace {

std::vector<BoundOption> Flat(const std::vector<OptionGroup>& groups) {
  std::vector<BoundOption> all;
  for (const OptionGroup& group : groups) {
    all.insert(all.end(), group.fields.begin(), group.fields.end());
  }
  return all;
}

// What the program makes of its command line.
struct Options {
  IngestOptions ingest;

  std::vector<BoundOption> All() {
    std::vector<BoundOption> all = Flat(ingest.Groups());
    for (const BoundOption& field : Flat(ingest.mapping.Groups())) all.push_back(field);
    for (const BoundOption& field : Flat(ingest.people.Groups())) all.push_back(field);
    return all;
  }

  const BoundOption& Find(const std::vector<BoundOption>& all, const std::string& name) const {
    for (const BoundOption& field : all) {
      if (field.name == name) return field;
    }
    ADD_FAILURE() << name << " is gone";
    return all.front();
  }
};

absl::StatusOr<Options> Parse(const std::vector<std::string>& more) {
  CLI::App app;
  IngestFlags flags;
  AddIngestFlags(&app, &flags);
  std::vector<std::string> arguments = {"--map=m", "--store=s", "log"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  // CLI11 takes them from the back.
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    app.parse(reversed);
  } catch (const CLI::ParseError& error) {
    return absl::InvalidArgumentError(error.what());
  }
  Options options;
  DSG_ASSIGN_OR_RETURN(options.ingest, MakeIngestOptions(flags));
  DSG_RETURN_IF_ERROR(MakeSegmentation(flags.segmenter).status());
  DSG_RETURN_IF_ERROR(options.ingest.Validate());
  return options;
}

std::string Given(const BoundOption& field, double number) {
  const BoundOption copy = field;
  const double before = copy.Get();
  copy.Set(number);
  std::string text = absl::StrCat("--", field.name, "=", copy.Text());
  copy.Set(before);
  return text;
}

TEST(Tuning, NamesAreUniqueAndDefaultsInRange) {
  Options options;
  std::set<std::string> names;
  std::set<std::variant<double*, int*, TimeNs*>> numbers;
  const std::vector<BoundOption> all = options.All();
  for (const BoundOption& field : all) {
    EXPECT_TRUE(names.insert(field.name).second) << field.name << " stands twice";
    EXPECT_TRUE(numbers.insert(field.value).second) << field.name << " is another one's number";
    EXPECT_TRUE(field.Check(field.Get()).ok()) << field.Check(field.Get());
    EXPECT_LT(field.min, field.max) << field.name;
  }
  EXPECT_GT(all.size(), 600u);
}

TEST(Tuning, EachFlagReachesItsStageAndNoOther) {
  Options standard;
  const std::vector<BoundOption> defaults = standard.All();
  for (const BoundOption& field : defaults) {
    const std::string name = field.name;
    // What only a network of the user's reads has a test of its own.
    if (name.rfind("person-look-", 0) == 0) continue;
    absl::StatusOr<Options> options = Parse({Given(field, OtherValue(field, defaults))});
    ASSERT_TRUE(options.ok()) << name << ": " << options.status();
    std::string changed;
    const std::vector<BoundOption> all = options->All();
    for (size_t i = 0; i < all.size(); ++i) {
      if (all[i].Get() != defaults[i].Get()) absl::StrAppend(&changed, all[i].name, " ");
    }
    EXPECT_EQ(changed, name + " ");
    EXPECT_EQ(options->Find(all, name).Get(), OtherValue(field, defaults)) << name;
  }
}

TEST(Tuning, EachNumberIsRefusedOutOfItsRange) {
  Options standard;
  for (const BoundOption& field : standard.All()) {
    for (const double wrong : {field.min - 1.0, field.max * 2.0 + 1.0, std::nan("")}) {
      EXPECT_FALSE(field.Check(wrong).ok()) << field.name << " " << wrong;
    }
    const auto options = Parse({absl::StrCat("--", field.name, "=", field.max * 2.0 + 1.0)});
    ASSERT_FALSE(options.ok()) << field.name;
    EXPECT_NE(options.status().message().find(absl::StrCat(field.name, " is ")), std::string::npos)
        << options.status();
  }
  for (const char* wrong : {"nan", "inf", "much", ""}) {
    EXPECT_FALSE(Parse({absl::StrCat("--track-lag=", wrong)}).ok()) << wrong;
    EXPECT_FALSE(Parse({absl::StrCat("--track-memory=", wrong)}).ok()) << wrong;
  }
  EXPECT_FALSE(Parse({"--track-lag=2.5"}).ok());
}

TEST(Tuning, EndsOfRangesAreThere) {
  Options standard;
  OdometryOptions odometry;
  std::vector<BoundOption> all = standard.All();
  for (const BoundOption& field : odometry.Bind()) all.push_back(field);
  int count = 0;
  for (const BoundOption& field : all) {
    if (field.lower_end == nullptr) continue;
    ++count;
    const BoundOption& lower = standard.Find(all, field.lower_end);
    EXPECT_LE(lower.Get(), field.Get()) << field.name;
    EXPECT_LT(lower.min, field.max) << field.name;
  }
  EXPECT_GE(count, 18);
  const auto options = Parse({"--place-body-low=0.5", "--place-body-high=0.3"});
  ASSERT_FALSE(options.ok());
  EXPECT_EQ(options.status().message(),
            "place-body-low is 0.5, above place-body-high, which is 0.3; give at most that");
  odometry.keyframe.period_ns_min = 2 * odometry.keyframe.period_ns_max;
  EXPECT_FALSE(ValidateOptions(odometry).ok());
}

TEST(Tuning, PeopleTellEachNumberInTheirDigest) {
  for (const bool is_paper : {false, true}) {
    PeopleOptions options = is_paper ? PeopleOptions::Paper() : PeopleOptions();
    std::set<std::string> digests = {options.Digest()};
    const std::vector<BoundOption> all = Flat(options.Groups());
    for (const BoundOption& field : all) {
      const double before = field.Get();
      field.Set(OtherValue(field, all));
      EXPECT_TRUE(options.Validate().ok()) << field.name;
      EXPECT_TRUE(digests.insert(options.Digest()).second) << field.name;
      field.Set(before);
    }
    // As it was before these numbers were options: what is known of logs stays known.
    EXPECT_EQ(options.Digest(),
              is_paper ? "paper letter 1 0000 auto 5 30 0 20" : "smooth 0 1111 auto 5 30 0 20");
  }
}

TEST(Tuning, LoopClosuresTellEachNumberInTheirDigest) {
  RobotGraphOptions options;
  // As it was before the numbers of the solver were options: what is known of logs stays known.
  std::set<std::string> digests = {""};
  ASSERT_EQ(DigestOptions(options), "");
  const std::vector<BoundOption> all = options.Bind();
  for (const BoundOption& field : all) {
    const double before = field.Get();
    field.Set(OtherValue(field, all));
    EXPECT_TRUE(ValidateOptions(options).ok()) << field.name;
    EXPECT_TRUE(digests.insert(DigestOptions(options)).second) << field.name;
    field.Set(before);
  }
  EXPECT_EQ(DigestOptions(options), "");
  EXPECT_GT(all.size(), 30u);
}

TEST(Tuning, PaperKeepsTheNumbersThatAreGiven) {
  absl::StatusOr<Options> options = Parse({"--people=paper", "--track-paper-walk=0.7"});
  ASSERT_TRUE(options.ok());
  EXPECT_EQ(options->ingest.people.tracker.torso.walk_sigma_m_s, 0.7);
  EXPECT_TRUE(options->ingest.people.tracker.is_first_consistent);
  EXPECT_FALSE(options->ingest.people.cues.is_floor_used);
}

TEST(Tuning, WhatOnlyANetworkReadsIsRefusedWithoutOne) {
  for (const auto& [flag, other] : std::vector<std::pair<std::string, std::string>>{
           {"--detector-score=0.7", "--detector"},
           {"--detector-size=320", "--detector"},
           {"--detector-class=3", "--detector"},
           {"--person-look-period=1", "--detector"},
           {"--person-look-overlap=0.3", "--detector"},
           {"--segmenter-size=256", "--segmenter"},
           {"--segmenter-mean=1", "--segmenter"},
           {"--segmenter-scale=1/128", "--segmenter"}}) {
    const auto options = Parse({flag});
    ASSERT_EQ(options.status().code(), absl::StatusCode::kInvalidArgument) << flag;
    EXPECT_NE(options.status().message().find("without " + other), std::string::npos)
        << options.status();
    EXPECT_EQ(options.status().message().find(flag.substr(0, flag.find('='))), 0u);
  }
  // As --print-config writes it.
  EXPECT_TRUE(Parse({"--segmenter-size=512", "--detector-score=0.5"}).ok());
}

TEST(Tuning, TheMeshOfOdometryIsMadeOnlyWhereItIsWanted) {
  const auto options_of = [](std::vector<std::string> arguments, bool is_on) {
    CLI::App app;
    OdometryFlags flags;
    AddOdometryFlags(&app, &flags);
    app.parse(arguments);
    return MakeOdometryOptions(flags, is_on);
  };
  const auto without = options_of({}, true);
  ASSERT_TRUE(without.ok() && without->has_value());
  EXPECT_FALSE((*without)->mesh.has_value());
  const auto with = options_of({"--odometry-mesh-edge=0.5", "--odometry-mesh=near.ply"}, true);
  ASSERT_TRUE(with.ok() && with->has_value() && (*with)->mesh.has_value());
  EXPECT_EQ((*with)->mesh->file, "near.ply");
  EXPECT_EQ((*with)->mesh->mesher.edge_m_max, 0.5);
  // The poses, and so the log, are the same.
  EXPECT_EQ((*with)->Digest(), (*without)->Digest());
  const auto refused = options_of({"--odometry-mesh=near.ply"}, false);
  EXPECT_NE(refused.status().message().find("--odometry-mesh changes nothing without --poses vio"),
            std::string::npos)
      << refused.status();
}

}  // namespace
}  // namespace dsg::ingest
