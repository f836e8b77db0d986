// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/mapping_options.h"
#include "tests/unit/ingest/config/other_value.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace dsg::ingest {
namespace {

std::vector<BoundOption> AllOf(MappingOptions* options) {
  std::vector<BoundOption> all;
  for (const OptionGroup& group : options->Groups()) {
    all.insert(all.end(), group.fields.begin(), group.fields.end());
  }
  return all;
}

TEST(MappingOptions, TellEachNumberOfAStageInTheDigest) {
  MappingOptions options;
  const std::string standard = options.Digest(/*has_labels=*/false);
  std::set<std::string> digests = {standard};
  const std::vector<BoundOption> all = AllOf(&options);
  for (const BoundOption& field : all) {
    const double before = field.Get();
    field.Set(OtherValue(field, all));
    EXPECT_TRUE(options.Validate().ok()) << field.name;
    EXPECT_TRUE(digests.insert(options.Digest(/*has_labels=*/false)).second) << field.name;
    field.Set(before);
  }
  EXPECT_EQ(options.Digest(/*has_labels=*/false), standard);
  options.rooms.split_corridors = false;
  EXPECT_NE(options.Digest(/*has_labels=*/true), MappingOptions().Digest(/*has_labels=*/true));
}

TEST(MappingOptions, AreRefusedOutOfTheirRangesByName) {
  MappingOptions options;
  EXPECT_TRUE(options.Validate().ok());
  std::set<std::string> names;
  for (const BoundOption& field : AllOf(&options)) {
    EXPECT_TRUE(names.insert(field.name).second) << field.name << " stands twice";
    const double before = field.Get();
    for (const double wrong : {field.min - 1.0, field.max + 1.0}) {
      field.Set(wrong);
      const absl::Status status = options.Validate();
      EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << field.name;
      EXPECT_NE(status.message().find(std::string(field.name) + " is "), std::string::npos)
          << status.message();
    }
    field.Set(before);
  }
}

}  // namespace
}  // namespace dsg::ingest
