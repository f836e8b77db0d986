// SPDX-License-Identifier: Apache-2.0
// Counts in sentences for people.
#pragma once

#include <cstdint>
#include <string>

namespace dsg {

/// "1 node", "2 nodes".
inline std::string Counted(int64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace dsg
