// SPDX-License-Identifier: Apache-2.0
// JSON text in fewer bytes: keys that scene graphs have are a byte, numbers are binary.
// The same text comes back, byte by byte; what is no compact JSON is not packed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "schema/codec/bit_stream.h"

namespace dsg {

/// Appends the packed text; false, and nothing is appended, for text that is no JSON object or
/// array without blanks.
bool PackJson(std::string_view text, std::string* out);

/// Appends the text that the next packed value stands for. False for bytes that PackJson cannot
/// have written, and beyond kUnpackedJsonMax bytes.
bool UnpackJson(ByteReader* in, std::string* text);
inline constexpr size_t kUnpackedJsonMax = size_t{1} << 20;

/// A double in as few bytes as its bits allow; the form must be kept beside.
enum class DoubleForm : uint8_t { kFixed, kVarint, kSwappedVarint };
DoubleForm ShortestForm(double value);
void AppendDouble(DoubleForm form, double value, std::string* out);
double ReadDouble(DoubleForm form, ByteReader* in);

}  // namespace dsg
