// SPDX-License-Identifier: Apache-2.0
// Files that gzip or Zstandard packed.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg::ingest {

/// Whether the bytes begin as gzip or Zstandard write them.
bool IsPacked(std::string_view bytes);

/// What was packed; several parts one after another are joined, as both programs do. The memory
/// grows with what really comes out, up to `byte_count_max`.
///
/// Requires: IsPacked.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `path` and how much came out, when the bytes are
/// cut or damaged, something else follows, or more than `byte_count_max` come out.
absl::StatusOr<std::string> Unpack(std::string_view bytes, const std::string& path,
                                   size_t byte_count_max);

}  // namespace dsg::ingest
