// SPDX-License-Identifier: Apache-2.0
#include "schema/base/utf8.h"

#include <cstdint>

namespace dsg {

bool IsUtf8(std::string_view text) {
  size_t i = 0;
  while (i < text.size()) {
    const auto lead = static_cast<uint8_t>(text[i++]);
    if (lead < 0x80) continue;
    // 0xC0 and 0xC1 could only begin an overlong form, 0xF5 and more a code point too large.
    const size_t tail = lead >= 0xC2 && lead <= 0xDF   ? 1
                        : lead >= 0xE0 && lead <= 0xEF ? 2
                        : lead >= 0xF0 && lead <= 0xF4 ? 3
                                                       : 0;
    if (tail == 0 || text.size() - i < tail) return false;
    uint32_t code = lead & (0x3Fu >> tail);
    for (size_t k = 0; k < tail; ++k) {
      const auto next = static_cast<uint8_t>(text[i++]);
      if ((next & 0xC0) != 0x80) return false;
      code = code << 6 | (next & 0x3Fu);
    }
    const bool overlong = (tail == 2 && code < 0x800) || (tail == 3 && code < 0x10000);
    const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
    if (overlong || surrogate || code > 0x10FFFF) return false;
  }
  return true;
}

}  // namespace dsg
