// SPDX-License-Identifier: Apache-2.0
// Images to the bytes of PNG and JPEG files, quickly; and back, for pictures of a log.
// Refuses to trust what it reads: only files that this simulator wrote are for Decode.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "ingest/sensor/image.h"

namespace dsg::simulator {

/// Lossless, tuned for speed: about 10 ms for a noisy grey image of 720 x 480.
/// Requires: gray8, rgb8, depth16 or label16. Errors: INTERNAL with what the library says.
absl::StatusOr<std::string> EncodePng(const ingest::Image& image);

/// Requires: gray8 or rgb8; quality from 1 to 100. Errors: INTERNAL with what the library says.
absl::StatusOr<std::string> EncodeJpeg(const ingest::Image& image, int quality);

/// Reads a PNG or JPEG file as the format asked for. Errors: NOT_FOUND; DATA_LOSS.
absl::StatusOr<ingest::Image> DecodeFile(const std::string& path, ingest::PixelFormat format);

}  // namespace dsg::simulator
