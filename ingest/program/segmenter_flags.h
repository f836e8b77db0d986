// SPDX-License-Identifier: Apache-2.0
// Command-line flags of dsg-ingest about the network that gives pixels classes.
// Refuses to know what is done with them.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/pipeline/segmented_log.h"

namespace CLI {
class App;
}  // namespace CLI

namespace dsg::ingest {

struct SegmenterFlags {
  std::string model_file;
  std::string classes_file;
  int size_px = SegmenterOptions().input_width_px;
  std::string mean = "0,0,0";
  std::string scale = "1/255";
};

void AddSegmenterFlags(CLI::App* app, SegmenterFlags* flags);

/// nullopt without --segmenter.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the flag, also of one that says nothing without
/// --segmenter; of MakeSegmentation.
absl::StatusOr<std::optional<Segmentation>> MakeSegmentation(const SegmenterFlags& flags);

}  // namespace dsg::ingest
