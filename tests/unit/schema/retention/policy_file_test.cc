// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/policy_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/retention/policy.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

std::string ErrorOf(const std::string& text) {
  const auto file = ParsePolicyFile(text, "p.yaml");
  return file.ok() ? "none" : std::string(file.status().message());
}

TEST(PolicyFile, ShippedFileIsRead) {
  const auto file = ReadPolicyFile(DSG_SOURCE_DIR "/docs/examples/long_term.yaml");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->every_ns, kNsPerDay);
  ASSERT_EQ(file->policies.size(), 4u);
  EXPECT_EQ(std::get<PrunePolicy::OlderThan>(file->policies[0].what).age_ns, 7 * kNsPerDay);
  EXPECT_EQ(file->policies[0].simplify_m, 0.05);
  EXPECT_EQ(std::get<PrunePolicy::HistoryOlderThan>(file->policies[3].what).age_ns, 30 * kNsPerDay);
}

TEST(PolicyFile, HoldsEveryKindOfPolicy) {
  const auto file = ParsePolicyFile(R"(
every: 15m
policies:
  - {name: a, branch: R3, strength: erase}
  - {name: b, region: [0, 0, 0, 1, 2, 3], layers: [objects, mesh]}
  - {name: c, before: 2026-01-01T00:00:00Z, simplify: 0.1, simplify_rad: 0.2}
  - {name: d, layer: mesh}
  - {name: e, unseen_since: 1000}
  - {name: f, unseen_for: 90s}
  - {name: g, history_before_revision: 12}
)",
                                    "p.yaml");
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_EQ(file->policies.size(), 7u);
  EXPECT_EQ(file->policies[0].strength, PruneStrength::kErase);
  EXPECT_EQ(std::get<PrunePolicy::Region>(file->policies[1].what).box_map.max().z(), 3.0);
  EXPECT_EQ(file->policies[1].layers, (std::vector<std::string>{"objects", "mesh"}));
  EXPECT_EQ(file->policies[2].simplify_rad, 0.2);
  EXPECT_EQ(std::get<PrunePolicy::UnseenSince>(file->policies[4].what).at_ns, 1000);
}

TEST(PolicyFile, SaysWhichShareMayGo) {
  const std::string rest = "policies:\n  - {name: a, layer: mesh}\n";
  EXPECT_EQ(ParsePolicyFile(rest, "p.yaml")->share_max, std::nullopt);
  EXPECT_EQ(ParsePolicyFile("share_max: 0.25\n" + rest, "p.yaml")->share_max, 0.25);
  for (const char* wrong : {"0", "-0.5", "1.5", "half"}) {
    const std::string error = ErrorOf(std::string("share_max: ") + wrong + "\n" + rest);
    EXPECT_EQ(error.substr(0, 21), "p.yaml:1:12: share_ma") << error;
  }
}

TEST(PolicyFile, ErrorsNameLineAndColumn) {
  EXPECT_EQ(ErrorOf("policies:\n  - name: a\n    brunch: R3\n").substr(0, 33),
            "p.yaml:3:5: unknown key \"brunch\";");
  EXPECT_EQ(ErrorOf("policies:\n  - {name: a, older_than: 30}\n").substr(0, 24),
            "p.yaml:2:27: older_than:");
  EXPECT_EQ(ErrorOf("policies: [\n").substr(0, 7), "p.yaml:");
}

TEST(PolicyFile, RefusesWhatIsHalfSaid) {
  for (const char* text :
       {"",
        "policies:",
        "policies: []",
        "every: 24h",
        "policies: 3",
        "[]",
        "policies: [{branch: R3}]",                        // no name
        "policies: [{name: a}]",                           // no what
        "policies: [{name: a, branch: R3, layer: mesh}]",  // two
        "policies: [{name: a, branch: R3}, {name: a, layer: mesh}]",
        "policies: [{name: a, branch: R3, branch: R4}]",
        "policies: [{name: a, branch: R3, simplify: 0.1}]",  // a branch has no poses
        "policies: [{name: a, older_than: 30d, simplify: -1}]",
        "policies: [{name: a, older_than: 30d, simplify: nan}]",
        "policies: [{name: a, older_than: 30d, simplify_rad: 0.1}]",  // thins without a bound
        "policies: [{name: a, older_than: 30d, layers: []}]",
        "policies: [{name: a, older_than: -1d}]",
        "policies: [{name: a, older_than: 1e3d}]",
        "policies: [{name: a, before: +30s}]",
        "policies: [{name: a, region: [0, 0, 0, -1, 1, 1]}]",
        "policies: [{name: a, region: [0, 0, 0, 1, 1]}]",
        "policies: [{name: a, layer: mesh, strength: forget}]",
        "policies: [{name: a, history_older_than: 1d, layers: [mesh]}]",
        "policies: [{name: a, history_older_than: 1d, strength: erase}]",
        "policies: [{name: a, branch: \"bed\\0room\"}]",
        "policies: [{name: \"a\\0\", branch: bedroom}]",
        "policies: [{name: a, branch: R3}]\n---\npolicies: [{name: b, branch: R4}]",
        "every: 10ms\npolicies: [{name: a, layer: mesh}]"}) {
    const auto file = ParsePolicyFile(text, "p.yaml");
    EXPECT_EQ(ReasonOf(file.status()), Reason::kFileMalformed) << text;
  }
}

TEST(PolicyFile, TellsWhereASecondDocumentBegins) {
  const auto file = ParsePolicyFile(
      "---\npolicies: [{name: a, branch: R3}]\n---\npolicies: [{name: b, branch: R4}]\n", "p.yaml");
  EXPECT_EQ(MetadataOf(file.status())["line"], "3") << file.status();
  EXPECT_TRUE(ParsePolicyFile("---\npolicies: [{name: a, branch: R3}]\n...\n", "p.yaml").ok());
}

TEST(Policy, BlamesTheFieldThatIsWrong) {
  for (const double wrong : {std::nan(""), -0.0, -1.0, 1e9, HUGE_VAL}) {
    PrunePolicy policy;
    policy.simplify_m = wrong;
    const absl::Status refused = policy.Validate();
    EXPECT_EQ(MetadataOf(refused)["field"], "simplify_m") << refused;
    EXPECT_EQ(refused.message().find("\"\""), std::string::npos) << refused;
  }
  PrunePolicy policy;
  EXPECT_EQ(MetadataOf(policy.Validate())["field"], "what");
  policy.what = PrunePolicy::Branch{std::string("bed\0room", 8)};
  EXPECT_EQ(MetadataOf(policy.Validate())["field"], "branch");
  policy.what = PrunePolicy::WholeLayer{"mesh"};
  policy.name = std::string("a\0b", 3);
  EXPECT_EQ(MetadataOf(policy.Validate())["field"], "name");
}

TEST(PolicyFile, ReadsPlainFilesOfBoundedSizeOnly) {
  EXPECT_TRUE(absl::IsNotFound(ReadPolicyFile("/dev/zero").status()));
  EXPECT_TRUE(absl::IsNotFound(ReadPolicyFile("/no/such/file").status()));
  const test::TempFolder folder;
  const std::string path = folder.path() + "/large.yaml";
  std::ofstream(path) << std::string(3 << 20, '#');
  EXPECT_EQ(ReasonOf(ReadPolicyFile(path).status()), Reason::kFileMalformed);
}

TEST(PolicyFile, SurvivesRandomEdits) {
  const uint64_t seed = test::TestSeed(64);
  const std::string whole =
      "every: 24h\npolicies:\n  - {name: a, region: [0, 0, 0, 1, 2, 3], layers: [mesh]}\n"
      "  - name: b\n    older_than: 7d\n    simplify: 0.05\n";
  const std::string letters = "[]{}:,-\n \"'&*!|>%@#0a\t\x01\xff";
  for (uint64_t stream = 0; stream < 3'000; ++stream) {
    Random random(seed, stream);
    std::string text = whole;
    for (int i = random.Integer(1, 6); i > 0; --i) {
      const auto at = static_cast<size_t>(random.Index(static_cast<int>(text.size())));
      text[at] = letters[static_cast<size_t>(random.Index(static_cast<int>(letters.size())))];
    }
    (void)ParsePolicyFile(text, "p.yaml");
  }
  (void)ParsePolicyFile(std::string(200'000, '['), "p.yaml");
  std::string nested;
  for (int i = 0; i < 100'000; ++i) nested += "- ";
  EXPECT_FALSE(ParsePolicyFile(nested, "p.yaml").ok());
}

TEST(Duration, ReadsWhatItWrites) {
  EXPECT_EQ(*ParseAge("90s"), 90 * kNsPerSecond);
  EXPECT_EQ(*ParseAge("1.5h"), 5400 * kNsPerSecond);
  EXPECT_EQ(*ParseAge("250ms"), kNsPerSecond / 4);
  EXPECT_EQ(FormatAge(30 * kNsPerDay), "30d");
  EXPECT_EQ(FormatAge(90 * kNsPerSecond), "90s");
  for (const char* text : {"", "d", "30", "0s", "-1s", "1e9s", "1 d", "1d1h", "infd", "40000d"}) {
    EXPECT_FALSE(ParseAge(text).ok()) << text;
  }
}

}  // namespace
}  // namespace dsg
