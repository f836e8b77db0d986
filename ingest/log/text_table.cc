// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/text_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

constexpr size_t kQuotedLengthMax = 80;
// Doubles count integers one by one up to here.
constexpr double kExactIntegerMax = 9007199254740992.0;

// Binary garbage and endless lines must not reach a terminal as they are.
std::string Quote(std::string_view value) {
  const std::string_view shown = value.substr(0, kQuotedLengthMax);
  return absl::StrCat("\"", absl::CHexEscape(absl::string_view(shown.data(), shown.size())),
                      value.size() > shown.size() ? "...\"" : "\"");
}

std::string_view Trim(std::string_view text) {
  const size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

// Takes a field in quotes off the front of `text`. False if it does not end.
bool TakeQuoted(std::string_view* text, std::string* field) {
  text->remove_prefix(1);
  while (true) {
    const size_t quote = text->find('"');
    if (quote == std::string_view::npos) return false;
    field->append(text->substr(0, quote));
    text->remove_prefix(quote + 1);
    if (!text->starts_with('"')) return true;
    field->push_back('"');
    text->remove_prefix(1);
  }
}

bool ReadDouble(std::string_view text, double* value) {
  if (!text.empty() && text[0] == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return error == std::errc() && end == text.data() + text.size();
}

// mantissa * 10^exponent as nanoseconds.
bool ScaleToNs(__int128 mantissa, int exponent, TimeNs* result) {
  for (int i = exponent + 9; i > 0 && mantissa != 0; --i) {
    mantissa *= 10;
    if (mantissa > kTimeMax) return false;
  }
  int digits_to_drop = -(exponent + 9);
  for (; digits_to_drop > 1 && mantissa != 0; --digits_to_drop) mantissa /= 10;
  if (digits_to_drop > 0) mantissa = (mantissa + 5) / 10;
  *result = static_cast<TimeNs>(mantissa);
  return mantissa <= kTimeMax;
}

bool ReadSeconds(std::string_view text, int power, TimeNs* result) {
  const bool negative = !text.empty() && text[0] == '-';
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  __int128 mantissa = 0;
  int exponent = 0;
  bool has_point = false;
  bool has_digit = false;
  size_t at = 0;
  for (; at < text.size(); ++at) {
    if (text[at] == '.' && !has_point) {
      has_point = true;
      continue;
    }
    if (text[at] < '0' || text[at] > '9') break;
    has_digit = true;
    // 30 digits are far below what 64 bits of nanoseconds can tell apart.
    if (mantissa > __int128{1'000'000'000'000'000'000} * 1'000'000'000'000) {
      if (!has_point) return false;
      continue;
    }
    mantissa = mantissa * 10 + (text[at] - '0');
    if (has_point) --exponent;
  }
  if (!has_digit) return false;
  if (at < text.size()) {
    if (text[at] != 'e' && text[at] != 'E') return false;
    std::string_view digits = text.substr(at + 1);
    if (!digits.empty() && digits[0] == '+') digits.remove_prefix(1);
    int shift = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), shift);
    if (error != std::errc() || end != digits.data() + digits.size() || std::abs(shift) > 99) {
      return false;
    }
    exponent += shift;
  }
  if (!ScaleToNs(mantissa, exponent + power, result)) return false;
  if (negative) *result = -*result;
  return true;
}

}  // namespace

bool LineReader::Next(TextLine* line) {
  while (!rest_.empty()) {
    number_ += number_ == 1 ? left_out_ + 1 : 1;
    const size_t end = rest_.find('\n');
    line->has_line_end = end != std::string_view::npos;
    line->text = rest_.substr(0, end);
    rest_.remove_prefix(line->has_line_end ? end + 1 : rest_.size());
    if (line->text.ends_with('\r')) line->text.remove_suffix(1);
    line->number = number_;
    if (!Trim(line->text).empty()) return true;
  }
  return false;
}

void SplitAtBlanks(std::string_view text, std::vector<std::string_view>* fields) {
  fields->clear();
  size_t begin = text.find_first_not_of(" \t");
  while (begin != std::string_view::npos) {
    const size_t end = text.find_first_of(" \t", begin);
    fields->push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(" \t", end);
  }
}

void SplitAtCommas(std::string_view text, std::vector<std::string_view>* fields, char comma) {
  fields->clear();
  size_t begin = 0;
  while (true) {
    const size_t end = text.find(comma, begin);
    fields->push_back(Trim(text.substr(begin, end - begin)));
    if (end == std::string_view::npos) return;
    begin = end + 1;
  }
}

bool SplitCsv(std::string_view text, char comma, std::deque<std::string>* unquoted,
              std::vector<std::string_view>* fields) {
  unquoted->clear();
  if (text.find('"') == std::string_view::npos) {
    SplitAtCommas(text, fields, comma);
    return true;
  }
  fields->clear();
  const char* const blanks = comma == '\t' ? " " : " \t";
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
    if (text.starts_with('"')) {
      if (!TakeQuoted(&text, &unquoted->emplace_back())) return false;
      fields->push_back(unquoted->back());
      text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
      if (!text.empty() && text.front() != comma) return false;
    } else {
      const size_t end = std::min(text.find(comma), text.size());
      fields->push_back(Trim(text.substr(0, end)));
      text.remove_prefix(end);
    }
    if (text.empty()) return true;
    text.remove_prefix(1);
  }
}

absl::Status LinePosition::Error(std::string_view message) const {
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(file, ":", line, ": ", std::string(message)),
                   {{"file", file}, {"line", absl::StrCat(line)}});
}

absl::Status LinePosition::FieldError(std::string_view field, std::string_view value,
                                      std::string_view message) const {
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(file, ":", line, ": field ", std::string(field), " is ",
                                Quote(value), "; ", std::string(message)),
                   {{"file", file},
                    {"line", absl::StrCat(line)},
                    {"field", std::string(field)},
                    {"value", Quote(value)}});
}

absl::Status CheckFieldCount(const LinePosition& at, const TextLine& line, size_t found,
                             size_t count, std::string_view columns) {
  if (found == count) return absl::OkStatus();
  const std::string expected =
      absl::StrCat("expected ", count, " columns (", std::string(columns), "), found ", found);
  if (!line.has_line_end && found < count) {
    return at.Error(absl::StrCat("the file ends in the middle of this line: ", expected,
                                 "; copy the log again, or remove the cut line"));
  }
  return at.Error(absl::StrCat(expected, ": ", Quote(line.text),
                               "; correct the line, or name another --format"));
}

absl::StatusOr<double> ParseNumber(const LinePosition& at, std::string_view field,
                                   std::string_view text) {
  double value = 0.0;
  if (!ReadDouble(text, &value)) {
    return at.FieldError(field, text, "a number is due; correct or remove the line");
  }
  if (!std::isfinite(value)) {
    return at.FieldError(field, text, "a finite number is due; remove the line");
  }
  return value;
}

absl::StatusOr<double> ParseCoordinate(const LinePosition& at, std::string_view field,
                                       std::string_view text) {
  DSG_ASSIGN_OR_RETURN(const double value, ParseNumber(at, field, text));
  if (std::abs(value) > kCoordinateMaxM) {
    return at.FieldError(field, text,
                         absl::StrCat("coordinates beyond ", kCoordinateMaxM / 1000.0,
                                      " km are refused; are the units metres?"));
  }
  return value;
}

absl::StatusOr<int64_t> ParseInteger(const LinePosition& at, std::string_view field,
                                     std::string_view text) {
  int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size()) return value;
  DSG_ASSIGN_OR_RETURN(const double number, ParseNumber(at, field, text));
  if (number != std::floor(number) || std::abs(number) > kExactIntegerMax) {
    return at.FieldError(field, text, "an integer is due; correct or remove the line");
  }
  return static_cast<int64_t>(number);
}

absl::StatusOr<int64_t> ParseFrame(const LinePosition& at, std::string_view text) {
  DSG_ASSIGN_OR_RETURN(const int64_t frame, ParseInteger(at, "frame", text));
  if (std::abs(static_cast<double>(frame)) > kExactIntegerMax) {
    return at.FieldError("frame", text, "frames lie within +-2^53; correct or remove the line");
  }
  return frame;
}

absl::StatusOr<Eigen::Quaterniond> Normalize(const LinePosition& at, const Eigen::Quaterniond& q) {
  const double norm = q.norm();
  if (std::abs(norm - 1.0) <= kQuaternionNormTolerance) return q.normalized();
  return at.FieldError("orientation", absl::StrCat(q.w(), " ", q.x(), " ", q.y(), " ", q.z()),
                       absl::StrCat("a unit quaternion (w x y z) is due, the norm is ", norm,
                                    "; correct or remove the line"));
}

absl::StatusOr<std::string> ParsePersonName(const LinePosition& at, std::string_view text) {
  DSG_ASSIGN_OR_RETURN(const int64_t person, ParseInteger(at, "person", text));
  if (person < 0) {
    return at.FieldError("person", text, "ids are integers from 0; correct or remove the line");
  }
  return absl::StrCat(person);
}

absl::StatusOr<TimeNs> ParseSeconds(const LinePosition& at, std::string_view field,
                                    std::string_view text, int power) {
  TimeNs value = 0;
  if (!ReadSeconds(text, power, &value)) {
    const std::string unit = power == 0 ? "seconds" : absl::StrCat("seconds times 1e", power);
    return at.FieldError(
        field, text,
        absl::StrCat("decimal ", unit, " within +-292 years are due; correct or remove the line"));
  }
  return value;
}

absl::StatusOr<TimeNs> AddToEpoch(const LinePosition& at, TimeNs epoch_ns, TimeNs offset_ns) {
  TimeNs sum = 0;
  if (__builtin_add_overflow(epoch_ns, offset_ns, &sum) || sum == kTimeMax || sum == kTimeMin) {
    return at.Error(absl::StrCat("epoch ", epoch_ns, " ns + ", offset_ns,
                                 " ns does not fit in 64 bits; correct the line or --epoch"));
  }
  return sum;
}

}  // namespace dsg::ingest
