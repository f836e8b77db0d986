// SPDX-License-Identifier: Apache-2.0
// A log whose colour images get label images by a network of the user's.
// Refuses to look at images that nobody asks for: those without depth are never segmented.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/agents/detector/segmenter.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// A network and the classes that it tells apart.
struct Segmentation {
  SegmenterOptions options;
  std::vector<SemanticLabel> labels;
  /// Of all that its label images depend on, hexadecimal.
  std::string sha256;
};

/// Reads the list of classes (ReadClassList) into `options` and runs the network once.
/// Errors: of ReadClassList and Segmenter::Load.
absl::StatusOr<Segmentation> MakeSegmentation(SegmenterOptions options);

/// The same log with a channel "label0" beside color0, or cam0 where it has no color0; its images
/// are made when they are loaded. A log that has label images already stays as it is, and says so
/// in its notes. The identity of the log takes in the network.
/// Errors: FIELD_INVALID when the log has neither color0 nor cam0; of Segmenter::Load.
absl::StatusOr<std::unique_ptr<LogSource>> SegmentLog(std::unique_ptr<LogSource> log,
                                                      const Segmentation& segmentation);

}  // namespace dsg::ingest
