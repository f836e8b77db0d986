// SPDX-License-Identifier: Apache-2.0
// The compressed chunks of a bag.
// Refuses output of another size than the chunk declares: what follows could not be trusted.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg::ingest {

/// The largest image that is read is 16 Mpx of floats, 64 MB, and may come on top of a chunk that
/// was about to be closed.
inline constexpr size_t kBagChunkBytesMax = size_t{128} << 20;
/// What a bag keeps of unpacked chunks: those of a second of stereo and colour, so that images that
/// were put in order are not unpacked a second time.
inline constexpr size_t kUnpackedBytesMax = size_t{96} << 20;

/// `compression`: "none", "bz2", "lz4" or "zstd".
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `origin`.
absl::StatusOr<std::string> DecompressChunk(std::string_view compression, std::string_view bytes,
                                            size_t declared_size, const std::string& origin);

}  // namespace dsg::ingest
