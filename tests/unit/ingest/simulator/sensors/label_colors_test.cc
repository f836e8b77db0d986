// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/label_colors.h"

#include <gtest/gtest.h>

#include <map>

#include "ingest/simulator/world/catalogue.h"

namespace dsg::simulator {
namespace {

TEST(LabelColors, DifferFromClassToClass) {
  std::map<Color, int> seen;
  for (int class_id = 0; class_id <= 99; ++class_id) {
    const auto [other, is_new] = seen.emplace(LabelColor(class_id), class_id);
    EXPECT_TRUE(is_new) << class_id << " looks like " << other->second;
  }
}

TEST(LabelTable, HoldsUnknownAndAllSurfaceClassesAscending) {
  const std::string table = LabelTable({{100, "corridor"}, {11, "chair"}, {1, "wall"}});
  EXPECT_EQ(table.substr(0, table.find('\n')), "name,red,green,blue,alpha,id");
  EXPECT_NE(table.find("\nunknown,0,0,0,255,0\nwall,"), std::string::npos);
  EXPECT_LT(table.find("wall,"), table.find("chair,"));
  EXPECT_EQ(table.find("corridor"), std::string::npos);
}

}  // namespace
}  // namespace dsg::simulator
