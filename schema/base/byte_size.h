// SPDX-License-Identifier: Apache-2.0
// How programs read options that are sizes in bytes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg {

/// A whole number of bytes, or of one of kB, MB, GB, TB (powers of 1000) and KiB, MiB, GiB, TiB
/// (of 1024); the B may be left out, and large and small letters mean the same.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID, also with a sign and beyond 64 bits.
absl::StatusOr<int64_t> ParseByteSize(std::string_view text);

/// ParseByteSize in the form that option parsers call: the text becomes bytes. Returns what is
/// wrong with it; empty if nothing is.
std::string TakeByteSize(std::string& text);

}  // namespace dsg
