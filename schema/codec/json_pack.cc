// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/json_pack.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "schema/model/known_names.h"

namespace dsg {
namespace {

constexpr size_t kDepthMax = 64;

// What a value begins with. Written, so it only grows.
enum Op : uint8_t {
  kEnd = 0x00,
  kNull = 0x01,
  kFalse = 0x02,
  kTrue = 0x03,
  kObject = 0x04,
  kArray = 0x05,
  kText = 0x06,
  kUnsigned = 0x07,
  kNegative = 0x08,
  kDouble = 0x09,
  kDoubleVarint = 0x0a,
  kDoubleSwapped = 0x0b,
  kFloat = 0x0c,
  /// Such as 3.0 or -1.0: its whole part.
  kPointZero = 0x0d,
  /// A number of a form that no other op gives back.
  kNumberText = 0x0e,
  kIntegers = 0x0f,
  kFixed32 = 0x10,
  /// Plus their DoubleForm: an array of numbers; an object of w, x, y and z.
  kDoubles = 0x11,
  kQuaternion = 0x14,
  /// From here a text of kKnownTexts.
  kKnown = 0x20,
  /// From here a whole number from 0 to 127.
  kSmall = 0x80,
};

// What a key begins with, besides kEnd; from here the number of a name; see attributes::NumberOf.
constexpr uint8_t kKeyText = 1;
constexpr uint8_t kKeyKnown = 2;

constexpr std::array<std::string_view, 14> kKnownTexts = {
    R"({"dimensions":[0.0,0.0,0.0],"type":"INVALID","world_P_center":[0.0,0.0,0.0],)"
    R"("world_R_center":{"w":1.0,"x":0.0,"y":0.0,"z":0.0}})",
    R"({"w":1.0,"x":0.0,"y":0.0,"z":0.0})",
    R"({"w":0.0,"x":0.0,"y":0.0,"z":0.0})",
    R"({"cols":0,"data":null,"rows":0})",
    R"({"a":255,"b":0,"g":0,"r":0})",
    R"({"has_colors":false,"has_first_seen_stamps":false,"has_labels":false,)"
    R"("has_timestamps":false})",
    "[0.0,0.0,0.0]",
    "[]",
    "{}",
    R"("")",
    R"("INVALID")",
    R"("AABB")",
    R"("OBB")",
    R"("RAABB")",
};

static_assert(attributes::kNumberEnd + kKeyKnown <= 256);
static_assert(kKnownTexts.size() + kKnown <= kSmall);

constexpr std::array<std::string_view, 4> kQuaternionKeys = {R"({"w":)", R"(,"x":)", R"(,"y":)",
                                                             R"(,"z":)"};

bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsNumberCharacter(char c) {
  return IsDigit(c) || c == '-' || c == '+' || c == '.' || c == 'e' || c == 'E';
}

template <typename T>
bool IsWrittenAs(T value, std::string_view text) {
  std::array<char, 64> written;
  const auto [end, error] = std::to_chars(written.data(), written.data() + written.size(), value);
  return error == std::errc() && std::string_view(written.data(), end) == text;
}

template <typename T>
void AppendNumber(T value, std::string* text) {
  std::array<char, 64> written;
  const auto [end, error] = std::to_chars(written.data(), written.data() + written.size(), value);
  if (error == std::errc()) text->append(written.data(), end);
}

template <typename T>
std::optional<T> Parse(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return IsWrittenAs(value, text) ? std::optional<T>(value) : std::nullopt;
}

class Packer {
 public:
  Packer(std::string_view text, std::string* out) : text_(text), out_(*out) {}

  bool Pack() {
    const char first = Here();
    return (first == '{' || first == '[') && Value(0) && at_ == text_.size();
  }

 private:
  char Here() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void Put(uint8_t byte) { out_.push_back(static_cast<char>(byte)); }
  bool Take(char expected) {
    if (Here() != expected) return false;
    ++at_;
    return true;
  }

  bool Value(size_t depth) {
    if (depth > kDepthMax) return false;
    const char c = Here();
    if ((c == '{' || c == '[' || c == '"') && Known()) return true;
    if (c == '{') return Quaternion() || Object(depth);
    if (c == '[') return Integers() || Doubles() || Array(depth);
    if (c == '"') {
      std::string_view text;
      if (!Text(&text)) return false;
      Put(kText);
      AppendVarint(text.size(), &out_);
      out_.append(text);
      return true;
    }
    return Word("null", kNull) || Word("true", kTrue) || Word("false", kFalse) || Number();
  }

  bool Word(std::string_view word, Op op) {
    if (text_.substr(at_, word.size()) != word) return false;
    at_ += word.size();
    Put(op);
    return true;
  }

  // A known text that is all of the value, not its begin.
  bool Known() {
    for (size_t i = 0; i < kKnownTexts.size(); ++i) {
      if (text_.substr(at_, kKnownTexts[i].size()) != kKnownTexts[i]) continue;
      at_ += kKnownTexts[i].size();
      Put(static_cast<uint8_t>(kKnown + i));
      return true;
    }
    return false;
  }

  // What stands between the quotes, escapes as they are.
  bool Text(std::string_view* text) {
    if (!Take('"')) return false;
    const size_t begin = at_;
    while (at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    if (at_ >= text_.size()) return false;
    *text = text_.substr(begin, at_ - begin);
    ++at_;
    return true;
  }

  bool Object(size_t depth) {
    Put(kObject);
    ++at_;
    if (Here() == '}') return false;
    do {
      std::string_view key;
      if (!Text(&key) || !Take(':')) return false;
      if (const auto number = attributes::NumberOf(key)) {
        Put(static_cast<uint8_t>(*number + kKeyKnown));
      } else {
        Put(kKeyText);
        AppendVarint(key.size(), &out_);
        out_.append(key);
      }
      if (!Value(depth + 1)) return false;
    } while (Take(','));
    Put(kEnd);
    return Take('}');
  }

  bool Array(size_t depth) {
    Put(kArray);
    ++at_;
    if (Here() == ']') return false;
    do {
      if (!Value(depth + 1)) return false;
    } while (Take(','));
    Put(kEnd);
    return Take(']');
  }

  // Lists of vertices and times: each minus the one before.
  bool Integers() {
    const size_t begin = at_;
    integers_.clear();
    ++at_;
    bool is_whole = true;
    do {
      const auto integer = Parse<int64_t>(TakeNumber());
      is_whole = integer.has_value();
      if (is_whole) integers_.push_back(*integer);
    } while (is_whole && Take(','));
    if (!is_whole || integers_.size() < 2 || !Take(']')) {
      at_ = begin;
      return false;
    }
    Put(kIntegers);
    AppendVarint(integers_.size(), &out_);
    uint64_t before = 0;
    for (const int64_t integer : integers_) {
      const auto bits = static_cast<uint64_t>(integer);
      AppendVarint(ZigZag(static_cast<int64_t>(bits - before)), &out_);
      before = bits;
    }
    return true;
  }

  bool Doubles() {
    const size_t begin = at_;
    doubles_.clear();
    ++at_;
    bool is_whole = true;
    do {
      is_whole = TakeDouble();
    } while (is_whole && Take(','));
    if (is_whole && doubles_.size() >= 2 && Take(']') && PutDoubles(kDoubles)) return true;
    at_ = begin;
    return false;
  }

  bool Quaternion() {
    const size_t begin = at_;
    doubles_.clear();
    for (const std::string_view key : kQuaternionKeys) {
      if (text_.substr(at_, key.size()) != key) break;
      at_ += key.size();
      if (!TakeDouble()) break;
    }
    if (doubles_.size() == kQuaternionKeys.size() && Take('}') && PutDoubles(kQuaternion)) {
      return true;
    }
    at_ = begin;
    return false;
  }

  bool TakeDouble() {
    const auto number = Parse<double>(TakeNumber());
    if (!number.has_value() || !std::isfinite(*number)) return false;
    doubles_.push_back(*number);
    return true;
  }

  // False if each in a form of its own is shorter.
  bool PutDoubles(Op op) {
    std::string shortest;
    DoubleForm form = DoubleForm::kFixed;
    size_t apart = 0;
    for (const double number : doubles_) apart += 1 + SizeOf(ShortestForm(number), number);
    for (const auto tried : {DoubleForm::kFixed, DoubleForm::kVarint, DoubleForm::kSwappedVarint}) {
      std::string bytes;
      for (const double number : doubles_) AppendDouble(tried, number, &bytes);
      if (!shortest.empty() && bytes.size() >= shortest.size()) continue;
      shortest = std::move(bytes);
      form = tried;
    }
    if (shortest.size() > apart) return false;
    Put(static_cast<uint8_t>(op + static_cast<uint8_t>(form)));
    if (op == kDoubles) AppendVarint(doubles_.size(), &out_);
    out_ += shortest;
    return true;
  }

  static size_t SizeOf(DoubleForm form, double number) {
    std::string bytes;
    AppendDouble(form, number, &bytes);
    return bytes.size();
  }

  std::string_view TakeNumber() {
    const size_t begin = at_;
    while (IsNumberCharacter(Here())) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  bool Number() {
    const std::string_view text = TakeNumber();
    if (text.empty()) return false;
    if (const auto whole = Parse<uint64_t>(text)) {
      PutUnsigned(*whole);
    } else if (const auto negative = Parse<int64_t>(text)) {
      Put(kNegative);
      AppendVarint(~static_cast<uint64_t>(*negative), &out_);
    } else if (text.ends_with(".0") && Parse<int64_t>(text.substr(0, text.size() - 2))) {
      Put(kPointZero);
      AppendVarint(ZigZag(*Parse<int64_t>(text.substr(0, text.size() - 2))), &out_);
    } else if (const auto number = Parse<double>(text); number && std::isfinite(*number)) {
      PutDouble(*number);
    } else {
      Put(kNumberText);
      AppendVarint(text.size(), &out_);
      out_.append(text);
    }
    return true;
  }

  void PutUnsigned(uint64_t value) {
    if (value < 0x80) return Put(static_cast<uint8_t>(kSmall + value));
    const bool is_word = value <= UINT32_MAX && VarintSize(value) > 4;
    Put(is_word ? kFixed32 : kUnsigned);
    if (is_word) {
      AppendFixed(static_cast<uint32_t>(value), &out_);
    } else {
      AppendVarint(value, &out_);
    }
  }

  void PutDouble(double value) {
    const auto single = static_cast<float>(value);
    const DoubleForm form = ShortestForm(value);
    const bool is_single =
        form == DoubleForm::kFixed &&
        std::bit_cast<uint64_t>(static_cast<double>(single)) == std::bit_cast<uint64_t>(value);
    if (is_single) {
      Put(kFloat);
      return AppendFixed(single, &out_);
    }
    Put(static_cast<uint8_t>(kDouble + static_cast<uint8_t>(form)));
    AppendDouble(form, value, &out_);
  }

  std::string_view text_;
  size_t at_ = 0;
  std::string& out_;
  std::vector<int64_t> integers_;
  std::vector<double> doubles_;
};

class Unpacker {
 public:
  Unpacker(ByteReader* in, std::string* text) : in_(*in), text_(*text), begin_(text->size()) {}

  bool Value(size_t depth) {
    if (depth > kDepthMax || !in_.ok()) return false;
    return ValueOf(in_.Fixed<uint8_t>(), depth) && in_.ok() &&
           text_.size() - begin_ <= kUnpackedJsonMax;
  }

 private:
  bool ValueOf(uint8_t op, size_t depth) {
    if (op >= kSmall) return Number(static_cast<uint64_t>(op - kSmall));
    if (op >= kKnown + kKnownTexts.size()) return false;
    if (op >= kKnown) return Append(kKnownTexts[op - kKnown]);
    switch (op) {
      case kNull:
        return Append("null");
      case kFalse:
        return Append("false");
      case kTrue:
        return Append("true");
      case kObject:
        return Object(depth);
      case kArray:
        return Array(depth);
      case kText:
        return Append("\"") && Append(in_.Bytes(in_.Varint())) && Append("\"");
      case kIntegers:
        return Integers();
      default:
        return NumberOf(op);
    }
  }

  bool NumberOf(uint8_t op) {
    switch (op) {
      case kUnsigned:
        return Number(in_.Varint());
      case kNegative:
        return Number(static_cast<int64_t>(~in_.Varint()));
      case kDouble:
      case kDoubleVarint:
      case kDoubleSwapped:
        return Real(ReadDouble(static_cast<DoubleForm>(op - kDouble), &in_));
      case kFloat:
        return Real(in_.Fixed<float>());
      case kPointZero:
        return Number(UnZigZag(in_.Varint())) && Append(".0");
      case kNumberText:
        return Append(in_.Bytes(in_.Varint()));
      case kFixed32:
        return Number(in_.Fixed<uint32_t>());
      default:
        break;
    }
    if (op >= kQuaternion && op < kQuaternion + 3) return Quaternion(FormOf(op, kQuaternion));
    return op >= kDoubles && op < kDoubles + 3 && Doubles(FormOf(op, kDoubles));
  }

  static DoubleForm FormOf(uint8_t op, Op first) { return static_cast<DoubleForm>(op - first); }

  bool Doubles(DoubleForm form) {
    const uint64_t count = in_.Varint();
    if (count > in_.remaining()) return false;
    Append("[");
    for (uint64_t i = 0; i < count && in_.ok(); ++i) {
      if (i > 0) Append(",");
      if (!Real(ReadDouble(form, &in_)) || text_.size() - begin_ > kUnpackedJsonMax) return false;
    }
    return in_.ok() && Append("]");
  }

  bool Quaternion(DoubleForm form) {
    for (const std::string_view key : kQuaternionKeys) {
      Append(key);
      if (!Real(ReadDouble(form, &in_))) return false;
    }
    return Append("}");
  }

  bool Append(std::string_view text) {
    text_ += text;
    return true;
  }

  template <typename T>
  bool Number(T value) {
    AppendNumber(value, &text_);
    return true;
  }

  bool Real(double value) { return std::isfinite(value) && Number(value); }

  bool Object(size_t depth) {
    Append("{");
    for (bool is_first = true;; is_first = false) {
      const auto key = in_.Fixed<uint8_t>();
      if (!in_.ok() || (key == kEnd && is_first)) return false;
      if (key == kEnd) return Append("}");
      const std::string_view name = key == kKeyText
                                        ? in_.Bytes(in_.Varint())
                                        : attributes::NameOf(static_cast<uint8_t>(key - kKeyKnown));
      if (key != kKeyText && name.empty()) return false;
      Append(is_first ? "\"" : ",\"");
      Append(name);
      Append("\":");
      if (!Value(depth + 1)) return false;
    }
  }

  bool Array(size_t depth) {
    Append("[");
    for (bool is_first = true;; is_first = false) {
      const auto op = in_.Fixed<uint8_t>();
      if (!in_.ok() || (op == kEnd && is_first)) return false;
      if (op == kEnd) return Append("]");
      if (!is_first) Append(",");
      const bool is_read = depth < kDepthMax && ValueOf(op, depth + 1) && in_.ok() &&
                           text_.size() - begin_ <= kUnpackedJsonMax;
      if (!is_read) return false;
    }
  }

  bool Integers() {
    const uint64_t count = in_.Varint();
    if (count > in_.remaining()) return false;
    Append("[");
    uint64_t value = 0;
    for (uint64_t i = 0; i < count && in_.ok(); ++i) {
      if (i > 0) Append(",");
      value += static_cast<uint64_t>(UnZigZag(in_.Varint()));
      Number(static_cast<int64_t>(value));
      if (text_.size() - begin_ > kUnpackedJsonMax) return false;
    }
    return in_.ok() && Append("]");
  }

  ByteReader& in_;
  std::string& text_;
  size_t begin_;
};

uint64_t Swapped(uint64_t bits) { return __builtin_bswap64(bits); }

}  // namespace

bool PackJson(std::string_view text, std::string* out) {
  const size_t before = out->size();
  if (text.size() <= kUnpackedJsonMax && Packer(text, out).Pack()) return true;
  out->resize(before);
  return false;
}

bool UnpackJson(ByteReader* in, std::string* text) { return Unpacker(in, text).Value(0); }

DoubleForm ShortestForm(double value) {
  const auto bits = std::bit_cast<uint64_t>(value);
  const int plain = VarintSize(bits);
  const int swapped = VarintSize(Swapped(bits));
  if (std::min(plain, swapped) >= static_cast<int>(sizeof(double))) return DoubleForm::kFixed;
  return plain <= swapped ? DoubleForm::kVarint : DoubleForm::kSwappedVarint;
}

void AppendDouble(DoubleForm form, double value, std::string* out) {
  const auto bits = std::bit_cast<uint64_t>(value);
  if (form == DoubleForm::kFixed) return AppendFixed(bits, out);
  AppendVarint(form == DoubleForm::kVarint ? bits : Swapped(bits), out);
}

double ReadDouble(DoubleForm form, ByteReader* in) {
  if (form == DoubleForm::kFixed) return in->Fixed<double>();
  const uint64_t bits = in->Varint();
  return std::bit_cast<double>(form == DoubleForm::kVarint ? bits : Swapped(bits));
}

}  // namespace dsg
