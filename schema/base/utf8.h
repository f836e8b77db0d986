// SPDX-License-Identifier: Apache-2.0
// UTF-8 as RFC 3629 has it: every text in a map is such text, and protobuf refuses any other.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace dsg {

/// One character at the front of a text.
struct Utf8Character {
  /// Its code point; 0 if the bytes are malformed.
  char32_t code = 0;
  /// Bytes to pass to reach the next character: at least 1, also for malformed bytes, of which the
  /// beginning of one character counts as one.
  size_t size = 1;
  bool is_valid = false;
};

/// Decodes the first character. Overlong forms, surrogates and code points beyond U+10FFFF are
/// malformed. Requires: `text` is not empty.
Utf8Character FirstUtf8(std::string_view text);

/// Where the first malformed character begins; the size of the text if it is well-formed.
size_t FindBadUtf8(std::string_view text);
inline bool IsUtf8(std::string_view text) { return FindBadUtf8(text) == text.size(); }

/// Appends a character. Requires: `code` is at most U+10FFFF and no surrogate.
void AppendUtf8(char32_t code, std::string* text);

/// The byte is inside a character: neither ASCII nor the first byte of a longer one.
inline bool IsUtf8Tail(char byte) { return (static_cast<unsigned char>(byte) & 0xC0) == 0x80; }

/// Characters (code points) of a well-formed text.
size_t CountUtf8(std::string_view text);

/// The longest front of `text` that has at most `bytes_max` bytes and ends between characters.
std::string_view Utf8Prefix(std::string_view text, size_t bytes_max);

}  // namespace dsg
