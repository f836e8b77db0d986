// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/color_name.h"

#include <algorithm>

#include "query/engine/search/text_match.h"

namespace dsg::query {
namespace {

struct Hsv {
  /// Degrees, [0, 360).
  double hue_deg = 0.0;
  double saturation = 0.0;
  double value = 0.0;
};

Hsv ToHsv(const Color& color) {
  const double red = color[0] / 255.0;
  const double green = color[1] / 255.0;
  const double blue = color[2] / 255.0;
  const double high = std::max({red, green, blue});
  const double span = high - std::min({red, green, blue});
  Hsv hsv;
  hsv.value = high;
  if (span <= 0.0) return hsv;
  hsv.saturation = span / high;
  double sixth = 0.0;
  if (high == red) {
    sixth = (green - blue) / span;
    if (sixth < 0.0) sixth += 6.0;
  } else if (high == green) {
    sixth = (blue - red) / span + 2.0;
  } else {
    sixth = (red - green) / span + 4.0;
  }
  hsv.hue_deg = 60.0 * sixth;
  return hsv;
}

std::string_view NameOfHue(double hue_deg) {
  if (hue_deg < 15.0) return "red";
  if (hue_deg < 42.0) return "orange";
  if (hue_deg < 70.0) return "yellow";
  if (hue_deg < 165.0) return "green";
  if (hue_deg < 200.0) return "cyan";
  if (hue_deg < 260.0) return "blue";
  if (hue_deg < 310.0) return "purple";
  if (hue_deg < 345.0) return "pink";
  return "red";
}

}  // namespace

const std::vector<std::string>& ColorNames() {
  static const auto* names =
      new std::vector<std::string>{"red",    "orange", "yellow", "green", "cyan", "blue",
                                   "purple", "pink",   "brown",  "black", "grey", "white"};
  return *names;
}

std::string CanonicalColor(std::string_view word) {
  std::string folded = FoldCase(word);
  if (folded == "gray") folded = "grey";
  if (folded == "violet") folded = "purple";
  const std::vector<std::string>& names = ColorNames();
  return std::find(names.begin(), names.end(), folded) != names.end() ? folded : "";
}

std::string_view NameOfColor(const Color& color) {
  const Hsv hsv = ToHsv(color);
  if (hsv.value < 0.2) return "black";
  if (hsv.saturation < 0.15) return hsv.value < 0.8 ? "grey" : "white";
  const std::string_view name = NameOfHue(hsv.hue_deg);
  // Brown is dark orange; pink is also pale red.
  if (hsv.hue_deg >= 10.0 && hsv.hue_deg < 50.0 && hsv.value < 0.65) return "brown";
  if (name == "red" && hsv.saturation < 0.55 && hsv.value >= 0.7) return "pink";
  return name;
}

}  // namespace dsg::query
