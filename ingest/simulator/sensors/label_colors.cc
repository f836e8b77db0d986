// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/label_colors.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/world/catalogue.h"

namespace dsg::simulator {
namespace {

// The large surfaces are calm, so that people and things stand out.
struct FixedColor {
  const char* class_name;
  Color color;
};
constexpr FixedColor kFixedColors[] = {{"wall", {168, 170, 178, 255}},
                                       {"floor", {120, 96, 72, 255}},
                                       {"ceiling", {224, 224, 218, 255}},
                                       {"glass", {150, 210, 226, 255}},
                                       {"human", {228, 26, 60, 255}}};

uint8_t ColorPart(double hue, double shift, double low, double high) {
  const double wave = 0.5 + 0.5 * std::cos(6.283185307179586 * (hue + shift));
  return static_cast<uint8_t>(std::lround(low + wave * (high - low)));
}

}  // namespace

Color LabelColor(int class_id) {
  if (class_id == 0) return {0, 0, 0, 255};
  for (const FixedColor& fixed : kFixedColors) {
    if (ClassId(fixed.class_name) == class_id) return fixed.color;
  }
  // The golden ratio spreads any number of hues; three levels of brightness part near ones.
  const double hue = std::fmod(class_id * 0.6180339887498949, 1.0);
  const double high = 255.0 - 50.0 * (class_id % 3);
  const double low = 20.0 + 25.0 * (class_id % 2);
  return {ColorPart(hue, 0.0, low, high), ColorPart(hue, -1.0 / 3.0, low, high),
          ColorPart(hue, 1.0 / 3.0, low, high), 255};
}

std::string LabelTable(const std::vector<SemanticLabel>& labels) {
  std::vector<SemanticLabel> sorted = labels;
  std::sort(sorted.begin(), sorted.end(),
            [](const SemanticLabel& a, const SemanticLabel& b) { return a.id < b.id; });
  std::string table = "name,red,green,blue,alpha,id\nunknown,0,0,0,255,0\n";
  for (const SemanticLabel& label : sorted) {
    if (label.id < 1 || label.id > kSurfaceClassMax) continue;
    const Color color = LabelColor(label.id);
    absl::StrAppend(&table, label.name, ",", static_cast<int>(color[0]), ",",
                    static_cast<int>(color[1]), ",", static_cast<int>(color[2]), ",255,", label.id,
                    "\n");
  }
  return table;
}

}  // namespace dsg::simulator
