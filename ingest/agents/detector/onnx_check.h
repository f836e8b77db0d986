// SPDX-License-Identifier: Apache-2.0
// Checks that an ONNX file is whole, that its tensors have as many numbers as they claim, and that
// each step's inputs are made before it. Refuses to judge the network: OpenCV does, and trusts
// this.
#pragma once

#include <string_view>

#include "absl/status/status.h"

namespace dsg::ingest {

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED saying what is wrong, without the file's name.
/// Cost: reads headers only, not weights.
/// Source: the field numbers of onnx.proto.
absl::Status CheckOnnx(std::string_view bytes);

}  // namespace dsg::ingest
