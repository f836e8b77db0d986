// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/bag/label_colors.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

using Color = std::array<uint8_t, 3>;

TEST(LabelColors, TakesTheFirstRowOfAClass) {
  const LabelColors colors = ColorsOf({{{"chair", 0x010203, 5},
                                        {"stool", 0x090909, 5},
                                        {"none", 0xfffefd, 0},
                                        {"far", 0x010101, 256},
                                        {"farther", 0x010101, 65535}}});
  EXPECT_EQ(colors[5], (Color{1, 2, 3}));
  EXPECT_EQ(colors[0], (Color{255, 254, 253}));
  EXPECT_FALSE(colors[6].has_value());
}

TEST(LabelColors, PaintsTheUnknownBlackUnlessTold) { EXPECT_EQ(ColorsOf({})[0], (Color{0, 0, 0})); }

TEST(LabelColors, NamesImageAndClassWithoutColour) {
  const ingest::Image labels{
      .width = 2, .height = 1, .format = ingest::PixelFormat::kLabel16, .bytes = {7, 0, 1, 200}};
  const absl::Status status = ColorLabels(labels, ColorsOf({}), "label0/9.png").status();
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed);
  EXPECT_NE(status.message().find("label0/9.png: class 200"), absl::string_view::npos) << status;
}

}  // namespace
}  // namespace dsg::simulator
