// SPDX-License-Identifier: Apache-2.0
// Computes from the bytes of a request how much memory it takes when parsed. The size on the wire
// is no bound: an empty sub-message has two bytes on the wire and takes hundreds when parsed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <vector>

namespace google::protobuf {
class Descriptor;
class FieldDescriptor;
namespace io {
class CodedInputStream;
class ZeroCopyInputStream;
}  // namespace io
}  // namespace google::protobuf

namespace dsg::server {

/// The costs of one request type and of all message types within it.
///
/// Threads: const after construction.
class RequestCost {
 public:
  explicit RequestCost(const google::protobuf::Descriptor* request);
  RequestCost(const RequestCost&) = delete;
  RequestCost& operator=(const RequestCost&) = delete;

  /// At least the bytes that parsing `wire`, which is read to its end, on an arena allocates, and
  /// rarely twice as many.
  /// Counting stops above `bytes_max`, and where the bytes are malformed, as parsing will.
  ///
  /// Cost: linear in the bytes, about the time to parse them.
  size_t Bytes(google::protobuf::io::ZeroCopyInputStream* wire, size_t bytes_max) const;

 private:
  enum class Kind : uint8_t { kUnknown, kVarint, kFixed32, kFixed64, kText, kMessage };
  struct Type;
  struct Field {
    Kind kind = Kind::kUnknown;
    /// Bytes of one element of a repeated field; 0 for a single number, which its message contains.
    size_t bytes = 0;
    const Type* type = nullptr;
  };
  struct Type {
    size_t bytes = 0;
    /// By field number.
    std::vector<Field> fields;
  };
  class Count;

  const Type* Add(const google::protobuf::Descriptor* descriptor);
  Field FieldOf(const google::protobuf::FieldDescriptor& field);

  // Stable addresses, since types refer to each other.
  std::deque<Type> types_;
  std::map<const google::protobuf::Descriptor*, const Type*> type_of_;
  const Type* request_ = nullptr;
};

}  // namespace dsg::server
