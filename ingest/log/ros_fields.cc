// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/ros_fields.h"

#include <fastcdr/exceptions/Exception.h>

#include <bit>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "ingest/log/bag_record.h"
#include "ingest/log/file_bytes.h"

namespace dsg::ingest {
namespace {

using eprosima::fastcdr::Cdr;

constexpr size_t kCdrHeader = 4;
// Big and little endian; others are lists of parameters and later versions of CDR.
constexpr int kPlainBig = 0;
constexpr int kPlainLittle = 1;
// Some writers fill up the last word.
constexpr size_t kPaddingMax = 7;

int RepresentationOf(const RosBytes& message) {
  if (message.bytes.size() < kCdrHeader) return kPlainLittle;
  return static_cast<uint8_t>(message.bytes[0]) << 8 | static_cast<uint8_t>(message.bytes[1]);
}

std::string_view BodyOf(const RosBytes& message) {
  if (message.encoding != RosEncoding::kCdr || message.bytes.size() < kCdrHeader) return {};
  return message.bytes.substr(kCdrHeader);
}

}  // namespace

// Fast-CDR takes bytes that could be written, and does not write them here.
RosFields::RosFields(const RosBytes& message)
    : encoding_(message.encoding),
      rest_(message.bytes),
      body_(BodyOf(message)),
      buffer_(const_cast<char*>(body_.data()), body_.size()) {
  if (encoding_ != RosEncoding::kCdr) return;
  representation_ = RepresentationOf(message);
  const bool is_plain = representation_ == kPlainBig || representation_ == kPlainLittle;
  is_cut_ = !is_plain || message.bytes.size() < kCdrHeader;
  if (is_cut_) return;
  cdr_.emplace(buffer_,
               representation_ == kPlainLittle ? Cdr::LITTLE_ENDIANNESS : Cdr::BIG_ENDIANNESS,
               Cdr::DDS_CDR);
}

template <typename T>
T RosFields::Get() {
  T value = 0;
  if (is_cut_) return value;
  if (!cdr_.has_value()) {
    const std::string_view bytes = Take(sizeof(T));
    if (bytes.size() != sizeof(T)) return 0;
    const uint64_t bits = LittleEndian(bytes, 0, sizeof(T));
    if constexpr (std::is_same_v<T, double>) return std::bit_cast<double>(bits);
    return static_cast<T>(bits);
  }
  try {
    cdr_->deserialize(value);
    return value;
  } catch (const eprosima::fastcdr::exception::Exception&) {
    is_cut_ = true;
    return 0;
  }
}

uint8_t RosFields::U8() { return Get<uint8_t>(); }
uint32_t RosFields::U32() { return Get<uint32_t>(); }
double RosFields::F64() { return Get<double>(); }

std::string_view RosFields::Take(uint64_t size) {
  if (is_cut_ || size == 0) return {};
  if (size > rest()) {
    is_cut_ = true;
    rest_ = {};
    return {};
  }
  if (!cdr_.has_value()) {
    const std::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }
  const std::string_view bytes(cdr_->getCurrentPosition(), size);
  // Alignment depends on the last field read: the last byte is read as one.
  if (size > 1) cdr_->jump(size - 1);
  U8();
  return bytes;
}

std::string_view RosFields::String() {
  std::string_view text = Take(U32());
  // CDR counts the zero at the end.
  if (cdr_.has_value() && text.ends_with('\0')) text.remove_suffix(1);
  return text;
}

std::string_view RosFields::Bytes() { return Take(U32()); }

RosHeader RosFields::Header() {
  RosHeader header;
  // A count, which ROS 2 left out.
  if (encoding_ == RosEncoding::kRos1) U32();
  const uint32_t seconds = U32();
  const auto nanoseconds = static_cast<TimeNs>(U32());
  const TimeNs signed_seconds = encoding_ == RosEncoding::kRos1
                                    ? static_cast<TimeNs>(seconds)
                                    : static_cast<TimeNs>(static_cast<int32_t>(seconds));
  header.stamp_ns = signed_seconds * kNsPerSecond + nanoseconds;
  header.frame_id = std::string(String());
  return header;
}

Eigen::Vector3d RosFields::Vector3() {
  Eigen::Vector3d v;
  for (Eigen::Index i = 0; i < 3; ++i) v[i] = F64();
  return v;
}

Eigen::Vector4d RosFields::Vector4() {
  Eigen::Vector4d v;
  for (Eigen::Index i = 0; i < 4; ++i) v[i] = F64();
  return v;
}

void RosFields::SkipDoubles(int count) {
  for (int i = 0; i < count; ++i) F64();
}

size_t RosFields::rest() const {
  if (encoding_ == RosEncoding::kRos1) return rest_.size();
  return cdr_.has_value() ? body_.size() - cdr_->getSerializedDataLength() : 0;
}

absl::Status RosFields::NotCut(const char* type, const std::string& origin) const {
  if (!is_cut_) return absl::OkStatus();
  if (encoding_ == RosEncoding::kCdr && representation_ > kPlainLittle) {
    return MalformedFile(origin, absl::StrCat("the message is serialised as kind ", representation_,
                                              " of CDR; plain CDR (0 and 1) is read"));
  }
  return MalformedFile(origin, absl::StrCat("the message is too short for ", type));
}

absl::Status RosFields::End(const char* type, const std::string& origin) const {
  const absl::Status not_cut = NotCut(type, origin);
  if (!not_cut.ok()) return not_cut;
  const size_t padding_max = encoding_ == RosEncoding::kCdr ? kPaddingMax : 0;
  if (rest() <= padding_max) return absl::OkStatus();
  return MalformedFile(origin, absl::StrCat("the message is ", rest(), " bytes too long for ", type,
                                            "; is the type another one?"));
}

}  // namespace dsg::ingest
