// SPDX-License-Identifier: Apache-2.0
#include "server/request_cost.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <string>

namespace dsg::server {
namespace {

namespace pb = google::protobuf;
using Wire = pb::internal::WireFormatLite;

// An array that grows by doubling has at most twice the needed capacity, and an arena also keeps
// the smaller arrays that it replaced, which together are as large.
constexpr size_t kGrowth = 4;
// Pointer to an element of a repeated message or string field.
constexpr size_t kListedBytes = kGrowth * sizeof(void*);
// Entry for a message in the arena's list of destructors.
constexpr size_t kDestructorBytes = 16;
// A string, its entry in the arena's list of destructors, and the heap's own header.
constexpr size_t kTextBytes = sizeof(std::string) + 16 + 16;
// Entry of a map field with its share of the hash buckets.
constexpr size_t kMapEntryBytes = 160;
// An unknown field with its share of a doubling array and of the set that holds it.
constexpr size_t kUnknownBytes = 160;
// The unfilled rest of an arena's last block, and the share left empty in earlier blocks when a
// long array came next.
constexpr size_t kArenaBytes = size_t{64} << 10;
constexpr size_t kUnfilledShare = 8;
// Parsing refuses deeper nesting.
constexpr int kDepthMax = 100;

size_t ElementBytes(pb::FieldDescriptor::CppType type) {
  switch (type) {
    case pb::FieldDescriptor::CPPTYPE_INT64:
    case pb::FieldDescriptor::CPPTYPE_UINT64:
    case pb::FieldDescriptor::CPPTYPE_DOUBLE:
      return 8;
    case pb::FieldDescriptor::CPPTYPE_BOOL:
      return 1;
    default:
      return 4;
  }
}

}  // namespace

// One walk over the bytes of one request.
class RequestCost::Count {
 public:
  Count(pb::io::CodedInputStream* input, size_t bytes_max) : input_(input), bytes_max_(bytes_max) {}

  // False where the walk must stop: at malformed bytes, or above the limit.
  bool Walk(const Type* type, int depth);
  size_t bytes() const { return kArenaBytes + bytes_ + bytes_ / kUnfilledShare; }

 private:
  bool WalkField(const Field& field, uint32_t tag, int depth);
  bool WalkSized(const Field& field, int depth);
  bool WalkPackedVarints(const Field& field, int size);
  bool Add(size_t bytes) { return (bytes_ += bytes) <= bytes_max_; }

  pb::io::CodedInputStream* const input_;
  const size_t bytes_max_;
  size_t bytes_ = 0;
};

bool RequestCost::Count::Walk(const Type* type, int depth) {
  static const Field kNoField;
  if (depth > kDepthMax) return false;
  while (const uint32_t tag = input_->ReadTag()) {
    if (Wire::GetTagWireType(tag) == Wire::WIRETYPE_END_GROUP) return true;
    const auto number = static_cast<size_t>(Wire::GetTagFieldNumber(tag));
    const bool is_known = type != nullptr && number < type->fields.size();
    if (!WalkField(is_known ? type->fields[number] : kNoField, tag, depth)) return false;
  }
  // The end of the message, or an invalid tag.
  return input_->ConsumedEntireMessage();
}

bool RequestCost::Count::WalkField(const Field& field, uint32_t tag, int depth) {
  uint64_t number = 0;
  uint32_t word = 0;
  // A field whose wire type does not match its declared type is kept as unknown.
  const auto bytes_if = [&](Kind kind) { return field.kind == kind ? field.bytes : kUnknownBytes; };
  switch (Wire::GetTagWireType(tag)) {
    case Wire::WIRETYPE_VARINT:
      return input_->ReadVarint64(&number) && Add(bytes_if(Kind::kVarint));
    case Wire::WIRETYPE_FIXED64:
      return input_->ReadLittleEndian64(&number) && Add(bytes_if(Kind::kFixed64));
    case Wire::WIRETYPE_FIXED32:
      return input_->ReadLittleEndian32(&word) && Add(bytes_if(Kind::kFixed32));
    case Wire::WIRETYPE_START_GROUP:
      return Add(2 * kUnknownBytes) && Walk(nullptr, depth + 1);
    case Wire::WIRETYPE_LENGTH_DELIMITED:
      return WalkSized(field, depth);
    default:
      return false;
  }
}

bool RequestCost::Count::WalkSized(const Field& field, int depth) {
  int size = 0;
  if (!input_->ReadVarintSizeAsInt(&size)) return false;
  const bool is_packed = field.bytes > 0;
  switch (field.kind) {
    case Kind::kMessage: {
      if (!Add(field.bytes)) return false;
      if (size == 0) return true;
      const auto limit = input_->PushLimit(size);
      if (!Walk(field.type, depth + 1)) return false;
      input_->PopLimit(limit);
      return true;
    }
    case Kind::kVarint:
      if (!is_packed) break;
      return WalkPackedVarints(field, size);
    case Kind::kFixed32:
    case Kind::kFixed64:
      if (!is_packed) break;
      return input_->Skip(size) && Add(kGrowth * static_cast<size_t>(size));
    case Kind::kText:
      return input_->Skip(size) && Add(field.bytes + static_cast<size_t>(size));
    case Kind::kUnknown:
      break;
  }
  return input_->Skip(size) && Add(kUnknownBytes + static_cast<size_t>(size));
}

bool RequestCost::Count::WalkPackedVarints(const Field& field, int size) {
  while (size > 0) {
    const void* data = nullptr;
    int here = 0;
    if (!input_->GetDirectBufferPointer(&data, &here)) return false;
    here = std::min(here, size);
    const auto* const begin = static_cast<const uint8_t*>(data);
    const auto count =
        std::count_if(begin, begin + here, [](uint8_t byte) { return (byte & 0x80) == 0; });
    if (!Add(field.bytes * static_cast<size_t>(count)) || !input_->Skip(here)) return false;
    size -= here;
  }
  return true;
}

RequestCost::RequestCost(const pb::Descriptor* request) : request_(Add(request)) {}

const RequestCost::Type* RequestCost::Add(const pb::Descriptor* descriptor) {
  const Type*& known = type_of_[descriptor];
  if (known != nullptr) return known;
  Type& type = types_.emplace_back();
  // Registered before its fields, which may be of the same type.
  known = &type;
  if (descriptor->options().map_entry()) {
    type.bytes = kMapEntryBytes;
  } else {
    const pb::Message* const empty =
        pb::MessageFactory::generated_factory()->GetPrototype(descriptor);
    type.bytes = empty->SpaceUsedLong() + kDestructorBytes;
  }
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const pb::FieldDescriptor& field = *descriptor->field(i);
    const auto number = static_cast<size_t>(field.number());
    if (number >= type.fields.size()) type.fields.resize(number + 1);
    const Field cost = FieldOf(field);
    type.fields[number] = cost;
  }
  return &type;
}

RequestCost::Field RequestCost::FieldOf(const pb::FieldDescriptor& field) {
  const size_t listed_bytes = field.is_repeated() ? kListedBytes : 0;
  switch (field.cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_MESSAGE: {
      const Type* const type = Add(field.message_type());
      return {Kind::kMessage, type->bytes + listed_bytes, type};
    }
    case pb::FieldDescriptor::CPPTYPE_STRING:
      return {Kind::kText, kTextBytes + listed_bytes, nullptr};
    default:
      break;
  }
  const size_t bytes = field.is_repeated() ? kGrowth * ElementBytes(field.cpp_type()) : 0;
  const auto wire = Wire::WireTypeForFieldType(static_cast<Wire::FieldType>(field.type()));
  const Kind kind = wire == Wire::WIRETYPE_VARINT    ? Kind::kVarint
                    : wire == Wire::WIRETYPE_FIXED64 ? Kind::kFixed64
                                                     : Kind::kFixed32;
  return {kind, bytes, nullptr};
}

size_t RequestCost::Bytes(pb::io::ZeroCopyInputStream* wire, size_t bytes_max) const {
  pb::io::CodedInputStream input(wire);
  Count count(&input, bytes_max);
  count.Walk(request_, 0);
  return count.bytes();
}

}  // namespace dsg::server
