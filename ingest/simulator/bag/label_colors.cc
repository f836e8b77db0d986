// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/bag/label_colors.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::simulator {

LabelColors ColorsOf(const ingest::LabelTable& table) {
  LabelColors colors;
  for (const ingest::LabelRow& row : table.rows) {
    const auto id = static_cast<size_t>(row.class_id);
    if (id >= colors.size() || colors[id].has_value()) continue;
    colors[id] = {static_cast<uint8_t>(row.rgb >> 16), static_cast<uint8_t>(row.rgb >> 8),
                  static_cast<uint8_t>(row.rgb)};
  }
  if (!colors[0].has_value()) colors[0] = {0, 0, 0};
  return colors;
}

absl::StatusOr<ingest::Image> ColorLabels(const ingest::Image& labels, const LabelColors& colors,
                                          const std::string& origin) {
  ingest::Image colored{.width = labels.width,
                        .height = labels.height,
                        .format = ingest::PixelFormat::kRgb8,
                        .bytes = {}};
  const size_t pixel_count = labels.bytes.size() / 2;
  colored.bytes.resize(pixel_count * 3);
  for (size_t i = 0; i < pixel_count; ++i) {
    // Little endian: the class is the second byte.
    const uint8_t class_id = labels.bytes[2 * i + 1];
    if (!colors[class_id].has_value()) {
      return MakeError(
          Reason::kFileMalformed,
          absl::StrCat(origin, ": class ", class_id, " has no line in labels.csv; add one"),
          {{"file", origin}, {"class", absl::StrCat(class_id)}});
    }
    std::copy_n(colors[class_id]->begin(), 3, colored.bytes.begin() + static_cast<int64_t>(3 * i));
  }
  return colored;
}

}  // namespace dsg::simulator
