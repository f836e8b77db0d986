// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/attribute_codec.h"

#include <cstdint>
#include <string_view>
#include <utility>

#include "absl/strings/escaping.h"
#include "schema/codec/json_pack.h"

namespace dsg {
namespace {

// Written, so it only grows. A double's is kAttributeNumber plus its DoubleForm.
enum AttributeForm : uint8_t {
  kAttributeFalse = 0,
  kAttributeTrue = 1,
  kAttributeNumber = 2,
  kAttributeText = 5,
  kAttributeJson = 6,
  /// A letter and base64: the letter, and the bytes that base64 stands for.
  kAttributeBase64 = 7,
};

constexpr uint8_t kNameText = 0;
constexpr char kCompressed = 'z';

void AppendBytes(std::string_view bytes, std::string* out) {
  AppendVarint(bytes.size(), out);
  out->append(bytes);
}

bool AppendBase64Attribute(const std::string& text, std::string* out) {
  std::string bytes;
  if (text.empty() || text.front() != kCompressed) return false;
  if (!absl::Base64Unescape(absl::string_view(text).substr(1), &bytes)) return false;
  if (absl::Base64Escape(bytes) != absl::string_view(text).substr(1)) return false;
  out->push_back(static_cast<char>(kAttributeBase64));
  out->push_back(text.front());
  AppendBytes(bytes, out);
  return true;
}

void AppendTextAttribute(const std::string& text, std::string* out) {
  const size_t before = out->size();
  out->push_back(static_cast<char>(kAttributeJson));
  if (PackJson(text, out)) return;
  out->resize(before);
  if (AppendBase64Attribute(text, out)) return;
  out->push_back(static_cast<char>(kAttributeText));
  AppendBytes(text, out);
}

void AppendAttribute(const AttributeValue& value, std::string* out) {
  if (const auto* text = std::get_if<std::string>(&value)) return AppendTextAttribute(*text, out);
  if (const auto* flag = std::get_if<bool>(&value)) {
    return out->push_back(static_cast<char>(*flag ? kAttributeTrue : kAttributeFalse));
  }
  const double number = std::get<double>(value);
  const DoubleForm form = ShortestForm(number);
  out->push_back(static_cast<char>(kAttributeNumber + static_cast<uint8_t>(form)));
  AppendDouble(form, number, out);
}

bool ReadAttribute(ByteReader* in, AttributeValue* value) {
  const auto kind = in->Fixed<uint8_t>();
  switch (kind) {
    case kAttributeFalse:
    case kAttributeTrue:
      *value = kind == kAttributeTrue;
      return true;
    case kAttributeText:
      *value = std::string(in->Bytes(in->Varint()));
      return true;
    case kAttributeJson:
      return UnpackJson(in, &value->emplace<std::string>());
    case kAttributeBase64: {
      std::string text(1, in->Fixed<char>());
      const std::string_view bytes = in->Bytes(in->Varint());
      text += absl::Base64Escape(absl::string_view(bytes.data(), bytes.size()));
      *value = std::move(text);
      return true;
    }
    default:
      if (kind > kAttributeNumber + static_cast<uint8_t>(DoubleForm::kSwappedVarint)) return false;
      *value = ReadDouble(static_cast<DoubleForm>(kind - kAttributeNumber), in);
      return true;
  }
}

}  // namespace

void AppendAttributes(const Attributes& attributes, std::string* out) {
  AppendVarint(attributes.size(), out);
  for (const auto& [name, value] : attributes) {
    if (const auto number = attributes::NumberOf(name)) {
      out->push_back(static_cast<char>(*number + 1));
    } else {
      out->push_back(static_cast<char>(kNameText));
      AppendBytes(name, out);
    }
    AppendAttribute(value, out);
  }
}

bool ReadAttributes(ByteReader* in, Attributes* attributes) {
  const uint64_t count = in->Varint();
  for (uint64_t i = 0; i < count && in->ok(); ++i) {
    const auto number = in->Fixed<uint8_t>();
    const std::string_view name = number == kNameText
                                      ? in->Bytes(in->Varint())
                                      : attributes::NameOf(static_cast<uint8_t>(number - 1));
    if (!in->ok() || (number != kNameText && name.empty())) return false;
    AttributeValue value;
    if (!ReadAttribute(in, &value) || !in->ok()) return false;
    attributes->insert_or_assign(attributes->end(), std::string(name), std::move(value));
  }
  return in->ok();
}

}  // namespace dsg
