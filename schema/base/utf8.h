// SPDX-License-Identifier: Apache-2.0
// Whether bytes are text. Protobuf refuses to read what is not, so nothing else may be stored.
#pragma once

#include <string_view>

namespace dsg {

/// True if the bytes are well-formed UTF-8 (RFC 3629), as every text in a map must be.
bool IsUtf8(std::string_view text);

}  // namespace dsg
