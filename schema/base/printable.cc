// SPDX-License-Identifier: Apache-2.0
#include "schema/base/printable.h"

#include <cstdint>
#include <string_view>

#include "absl/strings/str_format.h"
#include "schema/base/utf8.h"

namespace dsg {
namespace {

bool IsControl(char32_t code) { return code < 0x20 || (code >= 0x7f && code <= 0x9f); }

// Marks and embeddings of the Unicode bidirectional algorithm: with them a name may show as another
// one, and turn what stands behind it in the line.
bool TurnsWriting(char32_t code) {
  return (code >= 0x202a && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069) ||
         code == 0x200e || code == 0x200f || code == 0x061c;
}

}  // namespace

std::string Printable(const std::string& text) {
  std::string printable;
  for (std::string_view rest = text; !rest.empty();) {
    const Utf8Character character = FirstUtf8(rest);
    if (character.is_valid && IsControl(character.code)) {
      printable.push_back('?');
    } else if (character.is_valid && TurnsWriting(character.code)) {
      absl::StrAppendFormat(&printable, "\\u%04x", static_cast<uint32_t>(character.code));
    } else if (!character.is_valid) {
      for (const char byte : rest.substr(0, character.size)) {
        absl::StrAppendFormat(&printable, "\\x%02x", static_cast<unsigned char>(byte));
      }
    } else {
      printable.append(rest.substr(0, character.size));
    }
    rest.remove_prefix(character.size);
  }
  return printable;
}

std::string PrintableMessage(const std::string& text) {
  constexpr size_t kBytesMax = 4000;
  if (text.size() <= kBytesMax) return Printable(text);
  return Printable(std::string(Utf8Prefix(text, kBytesMax))) + "...";
}

}  // namespace dsg
