// SPDX-License-Identifier: Apache-2.0
#include "schema/base/utf8.h"

#include <algorithm>
#include <cstdint>

namespace dsg {

Utf8Character FirstUtf8(std::string_view text) {
  const auto lead = static_cast<uint8_t>(text.front());
  if (lead < 0x80) return {lead, 1, true};
  // No character begins with a byte above 0xF4; those above 0xF7 would not even fit the mask.
  const size_t size = lead >= 0xF8 ? 1 : lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC0 ? 2 : 1;
  char32_t code = lead & (0x7Fu >> size);
  size_t read = 1;
  for (; read < size && read < text.size() && IsUtf8Tail(text[read]); ++read) {
    code = code << 6 | (static_cast<uint8_t>(text[read]) & 0x3Fu);
  }
  constexpr char32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = code >= 0xD800 && code <= 0xDFFF;
  const bool is_valid =
      size > 1 && read == size && code >= kSmallest[size] && code <= 0x10FFFF && !is_surrogate;
  return {is_valid ? code : 0, read, is_valid};
}

size_t FindBadUtf8(std::string_view text) {
  size_t at = 0;
  while (at < text.size()) {
    if (static_cast<uint8_t>(text[at]) < 0x80) {
      ++at;
      continue;
    }
    const Utf8Character next = FirstUtf8(text.substr(at));
    if (!next.is_valid) return at;
    at += next.size;
  }
  return at;
}

void AppendUtf8(char32_t code, std::string* text) {
  const auto add = [text](char32_t byte) { text->push_back(static_cast<char>(byte)); };
  if (code < 0x80) return add(code);
  if (code < 0x800) {
    add(0xC0 | code >> 6);
  } else if (code < 0x10000) {
    add(0xE0 | code >> 12);
    add(0x80 | (code >> 6 & 0x3F));
  } else {
    add(0xF0 | code >> 18);
    add(0x80 | (code >> 12 & 0x3F));
    add(0x80 | (code >> 6 & 0x3F));
  }
  add(0x80 | (code & 0x3F));
}

size_t CountUtf8(std::string_view text) {
  return static_cast<size_t>(
      std::count_if(text.begin(), text.end(), [](char byte) { return !IsUtf8Tail(byte); }));
}

std::string_view Utf8Prefix(std::string_view text, size_t bytes_max) {
  if (text.size() <= bytes_max) return text;
  size_t end = bytes_max;
  while (end > 0 && IsUtf8Tail(text[end])) --end;
  return text.substr(0, end);
}

}  // namespace dsg
