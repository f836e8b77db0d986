// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/segmenter_flags.h"

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "ingest/config/option_flags.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// "0.5" or "1/255".
std::optional<double> ParseQuotient(const std::string& text) {
  double value = 1.0;
  bool is_first = true;
  for (const std::string& part : std::vector<std::string>(absl::StrSplit(text, '/'))) {
    double number = 0.0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
    if (error != std::errc() || end != part.data() + part.size()) return std::nullopt;
    value = is_first ? number : value / number;
    is_first = false;
  }
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

// One number for all channels, or three.
absl::StatusOr<std::array<double, 3>> ParseChannels(const std::string& flag,
                                                    const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ',');
  std::array<double, 3> values = {};
  bool is_sound = parts.size() == 1 || parts.size() == 3;
  for (size_t i = 0; i < 3 && is_sound; ++i) {
    const std::optional<double> value = ParseQuotient(parts[parts.size() == 1 ? 0 : i]);
    is_sound = value.has_value();
    values[i] = value.value_or(0.0);
  }
  if (is_sound) return values;
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--", flag, " ", text,
                                " is neither a number nor three of red,green,blue, as 1/255 or "
                                "123.7,116.3,103.5"),
                   {{"field", flag}, {"value", text}});
}

}  // namespace

void AddSegmenterFlags(CLI::App* app, SegmenterFlags* flags) {
  const std::string group = "Classes of pixels (logs without label images)";
  app->add_option("--segmenter", flags->model_file,
                  "Network that gives the pixels of colour images classes (ONNX)")
      ->group(group);
  app->add_option("--segmenter-classes", flags->classes_file,
                  "Its classes: a table with the columns id and name, or one name a line from 0 on")
      ->group(group);
  app->add_option("--segmenter-size", flags->size_px,
                  "Edge of the square picture that it takes, pixels")
      ->check(CLI::Range(32, 4096))
      ->capture_default_str()
      ->group(group);
  app->add_option("--segmenter-mean", flags->mean,
                  "What is taken from red,green,blue (0 to 255) first")
      ->capture_default_str()
      ->group(group);
  app->add_option("--segmenter-scale", flags->scale, "What the rest is multiplied by, one or three")
      ->capture_default_str()
      ->group(group);
}

absl::StatusOr<std::optional<Segmentation>> MakeSegmentation(const SegmenterFlags& flags) {
  if (flags.model_file.empty() && flags.classes_file.empty()) {
    const SegmenterFlags defaults;
    if (flags.size_px != defaults.size_px) return NeedsOther("segmenter-size", "segmenter");
    if (flags.mean != defaults.mean) return NeedsOther("segmenter-mean", "segmenter");
    if (flags.scale != defaults.scale) return NeedsOther("segmenter-scale", "segmenter");
    return std::nullopt;
  }
  if (flags.model_file.empty() || flags.classes_file.empty()) {
    return MakeError(Reason::kFieldInvalid,
                     "--segmenter and --segmenter-classes go together; give both",
                     {{"field", "segmenter"}, {"value", flags.model_file}});
  }
  SegmenterOptions options;
  options.model_file = flags.model_file;
  options.classes_file = flags.classes_file;
  options.input_width_px = options.input_height_px = flags.size_px;
  DSG_ASSIGN_OR_RETURN(options.mean, ParseChannels("segmenter-mean", flags.mean));
  DSG_ASSIGN_OR_RETURN(options.scale, ParseChannels("segmenter-scale", flags.scale));
  DSG_ASSIGN_OR_RETURN(Segmentation segmentation, MakeSegmentation(std::move(options)));
  return segmentation;
}

}  // namespace dsg::ingest
