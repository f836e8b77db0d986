// SPDX-License-Identifier: Apache-2.0
// Checks that a tensor in an ONNX file has as many numbers as its shape says.
// Refuses to read the numbers.
#pragma once

#include <string_view>

#include "absl/status/status.h"

namespace dsg::ingest {

/// Of a TensorProto. Errors: INVALID_ARGUMENT/FILE_MALFORMED with the tensor's name.
absl::Status CheckOnnxTensor(std::string_view message);

}  // namespace dsg::ingest
