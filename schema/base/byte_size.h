// SPDX-License-Identifier: Apache-2.0
// Sizes in bytes as program options.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg {

/// Parses an integer number of bytes, or of kB, MB, GB, TB (powers of 1000) or KiB, MiB, GiB, TiB
/// (powers of 1024). The B is optional and letter case is ignored.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID, also for a sign and above 63 bits.
absl::StatusOr<int64_t> ParseByteSize(std::string_view text);

/// ParseByteSize for option parsers: replaces the text by the number of bytes. Returns an error
/// message, empty on success.
std::string TakeByteSize(std::string& text);

}  // namespace dsg
