// SPDX-License-Identifier: Apache-2.0
// Pictures as PNG.
// Refuses to write files; it gives their bytes.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "schema/picture/raster.h"

namespace dsg::picture {

/// Errors: INTERNAL with what the library says.
absl::StatusOr<std::string> EncodePng(const Picture& picture);

}  // namespace dsg::picture
