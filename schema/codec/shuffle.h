// SPDX-License-Identifier: Apache-2.0
// zstd over byte planes: numbers of one size compress better when equal bytes stand together.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace dsg {

/// Plain zstd, level 3.
std::string Compress(std::string_view bytes);
/// False unless the frame unpacks to at most `size_max` bytes.
bool Decompress(std::string_view compressed, size_t size_max, std::string* bytes);

/// Requires: bytes.size() is a multiple of `item_size`.
std::string CompressShuffled(std::string_view bytes, size_t item_size);
/// False unless the frame unpacks to exactly `size` bytes.
bool DecompressShuffled(std::string_view compressed, size_t item_size, size_t size,
                        std::string* bytes);

}  // namespace dsg
