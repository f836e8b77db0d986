// SPDX-License-Identifier: Apache-2.0
// A network's file in memory, checked as far as that goes without running it.
// Refuses files that are no ONNX.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dsg::ingest {

/// INVALID_ARGUMENT/FILE_MALFORMED that names the file.
absl::Status BadModel(const std::string& file, const std::string& what);

/// Errors: NOT_FOUND when it is missing; INVALID_ARGUMENT/FILE_MALFORMED when it is not a regular
/// file, is empty, cut, larger than 1 GiB or no ONNX.
absl::StatusOr<std::vector<uint8_t>> ReadModelFile(const std::string& file);

}  // namespace dsg::ingest
