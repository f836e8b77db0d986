// SPDX-License-Identifier: Apache-2.0
// A network of the user's on OpenCV's CPU: loaded with care, run on one picture at a time.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/agents/detector/letterbox.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// Edges of a network's input, pixels.
inline constexpr int kNetworkInputPxMax = 4096;

/// Threads: one caller at a time.
class Network {
 public:
  explicit Network(const cv::dnn::Net& net) : net_(net) {}

  /// Reads a file of ReadModelFile, and gives the network to `rehearse`, once in a process of its
  /// own, since OpenCV may crash or run for ever, and then here.
  /// Errors: of ReadModelFile; INVALID_ARGUMENT/FILE_MALFORMED naming the file, with OpenCV's words
  /// or those of `rehearse`, whose FIELD_INVALID is passed on.
  static absl::StatusOr<Network> Load(
      const std::string& file, const std::function<absl::Status(Network& network)>& rehearse);

  /// All outputs for an input of [1, channels, height, width] floats.
  /// Errors: INTERNAL with OpenCV's words.
  absl::StatusOr<std::vector<cv::Mat>> Run(const cv::Mat& blob);

 private:
  cv::dnn::Net net_;
};

/// Without the source line, and on one line.
std::string WordsOf(const std::exception& exception);

std::vector<int> ShapeOf(const cv::Mat& mat);

/// Errors: INVALID_ARGUMENT/FIELD_INVALID for a picture that is no whole gray8 or rgb8; `who` asks.
absl::Status CheckNetworkImage(const std::string& who, const Image& image);

/// Red, green, blue, with bars of `bars` around it. Requires: CheckNetworkImage; may throw
/// cv::Exception.
cv::Mat MakeInput(const Image& image, const Letterbox& letterbox, int width_px, int height_px,
                  const cv::Scalar& bars);

}  // namespace dsg::ingest
