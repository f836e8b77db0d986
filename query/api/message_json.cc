// SPDX-License-Identifier: Apache-2.0
#include "query/api/message_json.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver.h>
#include <google/protobuf/util/type_resolver_util.h>
#include <google/protobuf/wrappers.pb.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/base/spelling.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

namespace pb = google::protobuf;
using Field = pb::FieldDescriptor;

// Text that JSON writes as it is.
bool IsPlain(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) {
    return c >= ' ' && c <= '~' && c != '"' && c != '\\' && c != '<' && c != '>';
  });
}

// Such as a field mask, which is text in JSON.
bool IsProtobufs(const pb::Descriptor& type) { return type.file()->package() == "google.protobuf"; }

// Protobuf's printer has values that may be missing after the others, as they come on the wire.
bool ComesLast(const Field& field) {
  if (field.is_repeated()) return false;
  return field.message_type() == nullptr ? field.containing_oneof() != nullptr
                                         : IsProtobufs(*field.message_type());
}

// Writes what protobuf's own printer writes for a message and these options: names as in the .proto
// file, fields without presence always, maps sorted. That printer describes all types anew for each
// message, and makes a tree of its text: 75 us for the reply of LocateAgent, where this takes a
// few. A test compares the two.
class Printer {
 public:
  Printer(JsonLayout layout, size_t bytes_max)
      : is_indented_(layout == JsonLayout::kIndented), bytes_max_(bytes_max) {}

  void PrintMessage(const pb::Message& message);
  std::string TakeText() { return std::move(text_); }
  /// OK unless the text is longer than it may be, or not all of it is UTF-8.
  absl::Status status() const { return status_; }

 private:
  void PrintField(const pb::Message& message, const Field& field);
  void PrintList(const pb::Message& message, const Field& field);
  void PrintMap(const pb::Message& message, const Field& field);
  // Of a repeated field the element `index`, otherwise -1.
  void PrintValue(const pb::Message& message, const Field& field, int index);
  void PrintText(const std::string& text);
  // What is rare, or a type of protobuf's own.
  void PrintByProtobuf(const pb::Message& message);
  template <typename Real>
  void PrintReal(Real value);

  void Open(char bracket);
  // Before each entry of what is open.
  void Next();
  void Close(char bracket);
  void NewLine();

  const bool is_indented_;
  const size_t bytes_max_;
  std::string text_;
  size_t depth_ = 0;
  bool is_empty_ = true;
  absl::Status status_;
};

void Printer::Open(char bracket) {
  text_ += bracket;
  ++depth_;
  is_empty_ = true;
}

void Printer::Next() {
  if (!is_empty_) text_ += ',';
  is_empty_ = false;
  NewLine();
}

void Printer::Close(char bracket) {
  --depth_;
  if (!is_empty_) NewLine();
  is_empty_ = false;
  text_ += bracket;
}

void Printer::NewLine() {
  if (!is_indented_) return;
  text_ += '\n';
  text_.append(depth_, ' ');
}

void Printer::PrintMessage(const pb::Message& message) {
  if (text_.size() > bytes_max_) {
    status_ = MakeError(Reason::kLimitExceeded,
                        absl::StrCat("the reply takes more than ", bytes_max_,
                                     " bytes as JSON; ask for less at a time, or for protobuf"),
                        {{"bytes_max", absl::StrCat(bytes_max_)}});
  }
  if (!status_.ok()) return;
  const pb::Descriptor& type = *message.GetDescriptor();
  if (IsProtobufs(type)) {
    PrintByProtobuf(message);
    return;
  }
  Open('{');
  std::vector<const Field*> last;
  for (int i = 0; i < type.field_count(); ++i) {
    const Field& field = *type.field(i);
    if (ComesLast(field)) {
      if (message.GetReflection()->HasField(message, &field)) last.push_back(&field);
    } else if (field.is_repeated() || field.message_type() == nullptr ||
               message.GetReflection()->HasField(message, &field)) {
      PrintField(message, field);
    }
  }
  std::sort(last.begin(), last.end(),
            [](const Field* a, const Field* b) { return a->number() < b->number(); });
  for (const Field* field : last) PrintField(message, *field);
  Close('}');
}

void Printer::PrintField(const pb::Message& message, const Field& field) {
  Next();
  absl::StrAppend(&text_, "\"", field.name(), is_indented_ ? "\": " : "\":");
  if (field.is_map()) {
    PrintMap(message, field);
  } else if (field.is_repeated()) {
    PrintList(message, field);
  } else {
    PrintValue(message, field, -1);
  }
}

void Printer::PrintList(const pb::Message& message, const Field& field) {
  Open('[');
  const int count = message.GetReflection()->FieldSize(message, &field);
  for (int i = 0; i < count; ++i) {
    Next();
    PrintValue(message, field, i);
  }
  Close(']');
}

void Printer::PrintMap(const pb::Message& message, const Field& field) {
  const pb::Reflection& reflection = *message.GetReflection();
  const Field& key = *field.message_type()->map_key();
  // All keys of the protocol are text.
  std::vector<std::pair<std::string, const pb::Message*>> entries;
  for (int i = 0; i < reflection.FieldSize(message, &field); ++i) {
    const pb::Message& entry = reflection.GetRepeatedMessage(message, &field, i);
    entries.emplace_back(entry.GetReflection()->GetString(entry, &key), &entry);
  }
  std::sort(entries.begin(), entries.end());
  Open('{');
  for (const auto& [name, entry] : entries) {
    Next();
    PrintText(name);
    text_ += is_indented_ ? ": " : ":";
    PrintValue(*entry, *field.message_type()->map_value(), -1);
  }
  Close('}');
}

void Printer::PrintValue(const pb::Message& message, const Field& field, int index) {
  const pb::Reflection& r = *message.GetReflection();
  const bool is_element = index >= 0;
  switch (field.cpp_type()) {
    case Field::CPPTYPE_INT32:
      absl::StrAppend(&text_, is_element ? r.GetRepeatedInt32(message, &field, index)
                                         : r.GetInt32(message, &field));
      return;
    case Field::CPPTYPE_UINT32:
      absl::StrAppend(&text_, is_element ? r.GetRepeatedUInt32(message, &field, index)
                                         : r.GetUInt32(message, &field));
      return;
    case Field::CPPTYPE_INT64:
      absl::StrAppend(
          &text_, "\"",
          is_element ? r.GetRepeatedInt64(message, &field, index) : r.GetInt64(message, &field),
          "\"");
      return;
    case Field::CPPTYPE_UINT64:
      absl::StrAppend(
          &text_, "\"",
          is_element ? r.GetRepeatedUInt64(message, &field, index) : r.GetUInt64(message, &field),
          "\"");
      return;
    case Field::CPPTYPE_DOUBLE: {
      const double value =
          is_element ? r.GetRepeatedDouble(message, &field, index) : r.GetDouble(message, &field);
      PrintReal(value);
      return;
    }
    case Field::CPPTYPE_FLOAT: {
      const float value =
          is_element ? r.GetRepeatedFloat(message, &field, index) : r.GetFloat(message, &field);
      PrintReal(value);
      return;
    }
    case Field::CPPTYPE_BOOL:
      text_ += (is_element ? r.GetRepeatedBool(message, &field, index) : r.GetBool(message, &field))
                   ? "true"
                   : "false";
      return;
    case Field::CPPTYPE_ENUM: {
      const int number = is_element ? r.GetRepeatedEnumValue(message, &field, index)
                                    : r.GetEnumValue(message, &field);
      const auto* const value = field.enum_type()->FindValueByNumber(number);
      // A number that this build has no name for.
      absl::StrAppend(&text_, value == nullptr ? absl::StrCat(number)
                                               : absl::StrCat("\"", value->name(), "\""));
      return;
    }
    case Field::CPPTYPE_STRING: {
      std::string scratch;
      const std::string& value =
          is_element ? r.GetRepeatedStringReference(message, &field, index, &scratch)
                     : r.GetStringReference(message, &field, &scratch);
      if (field.type() == Field::TYPE_BYTES) {
        absl::StrAppend(&text_, "\"", absl::Base64Escape(value), "\"");
      } else {
        PrintText(value);
      }
      return;
    }
    case Field::CPPTYPE_MESSAGE:
      PrintMessage(is_element ? r.GetRepeatedMessage(message, &field, index)
                              : r.GetMessage(message, &field));
      return;
  }
}

void Printer::PrintText(const std::string& text) {
  if (IsPlain(text)) {
    absl::StrAppend(&text_, "\"", text, "\"");
    return;
  }
  pb::StringValue value;
  value.set_value(text);
  PrintByProtobuf(value);
}

void Printer::PrintByProtobuf(const pb::Message& message) {
  std::string text;
  const pb::util::Status written = pb::util::MessageToJsonString(message, &text);
  text_ += text;
  if (!written.ok()) {
    status_ = absl::InternalError(
        absl::StrCat("the reply cannot be written as JSON: ", written.ToString()));
  }
}

// As printf's %g with the digits that every such number has or, where these do not give the same
// number again, with as many as always do.
template <typename Real>
void Printer::PrintReal(Real value) {
  if (!std::isfinite(value)) {
    text_ += std::isnan(value) ? "\"NaN\"" : value > 0 ? "\"Infinity\"" : "\"-Infinity\"";
    return;
  }
  constexpr int kDigits = std::numeric_limits<Real>::digits10;
  constexpr int kMoreDigits = kDigits + (std::is_same_v<Real, double> ? 2 : 3);
  char text[40];
  auto end = std::to_chars(text, std::end(text), value, std::chars_format::general, kDigits);
  Real read = 0;
  std::from_chars(text, end.ptr, read);
  if (read != value) {
    end = std::to_chars(text, std::end(text), value, std::chars_format::general, kMoreDigits);
  }
  text_.append(text, end.ptr);
}

// The field of the request itself that protobuf does not know; empty if the problem is another.
std::string UnknownField(std::string_view problem) {
  constexpr std::string_view kEnd = ": Cannot find field.";
  if (!problem.ends_with(kEnd)) return "";
  problem.remove_suffix(kEnd.size());
  const bool is_name = std::all_of(problem.begin(), problem.end(), [](unsigned char c) {
    return absl::ascii_isalnum(c) || c == '_';
  });
  return is_name ? std::string(problem) : "";
}

// The field with a value that is none of its type, as protobuf says it: "(at_ns): invalid ...".
std::string FieldOfValue(std::string_view problem) {
  const size_t end = problem.find("): ");
  if (!problem.starts_with('(') || end == std::string_view::npos) return "";
  return std::string(problem.substr(1, end - 1));
}

std::vector<std::string> FieldsOf(const pb::Descriptor& type) {
  std::vector<std::string> names;
  for (int i = 0; i < type.field_count(); ++i) names.push_back(type.field(i)->name());
  return names;
}

}  // namespace

absl::StatusOr<std::string> JsonOfMessage(const pb::Message& message, JsonLayout layout,
                                          size_t bytes_max) {
  Printer printer(layout, bytes_max);
  printer.PrintMessage(message);
  DSG_RETURN_IF_ERROR(printer.status());
  return printer.TakeText() + "\n";
}

absl::StatusOr<std::string> BytesOfJson(std::string_view json, const pb::Descriptor& type) {
  constexpr char kUrlPrefix[] = "type.googleapis.com";
  static pb::util::TypeResolver& types =
      *pb::util::NewTypeResolverForDescriptorPool(kUrlPrefix, pb::DescriptorPool::generated_pool());
  pb::io::ArrayInputStream in(json.data(), static_cast<int>(json.size()));
  std::string bytes;
  pb::io::StringOutputStream out(&bytes);
  const pb::util::Status status =
      pb::util::JsonToBinaryStream(&types, absl::StrCat(kUrlPrefix, "/", type.full_name()), &in,
                                   &out, pb::util::JsonParseOptions());
  if (status.ok()) return bytes;
  std::string problem(status.message());
  std::string field = UnknownField(problem);
  std::string advice = "; proto/dsg/v1 has the fields of each request";
  if (field.empty()) {
    field = FieldOfValue(problem);
  } else {
    advice = SpellingHint(field, FieldsOf(type));
  }
  if (problem.ends_with('.')) problem.pop_back();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("the request is no ", type.full_name(), " in JSON: ", problem, advice),
      {{"field", field}});
}

}  // namespace dsg::query
