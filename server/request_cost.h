// SPDX-License-Identifier: Apache-2.0
// What a request will take in memory, found from its bytes before it is parsed. Two bytes, an empty
// sub-message, become hundreds when parsed, so that a size on the wire bounds nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <vector>

#include "grpcpp/support/byte_buffer.h"

namespace google::protobuf {
class Descriptor;
class FieldDescriptor;
namespace io {
class CodedInputStream;
}  // namespace io
}  // namespace google::protobuf

namespace dsg::server {

/// The costs of one type of requests and of all types within it.
///
/// Threads: const after construction.
class RequestCost {
 public:
  explicit RequestCost(const google::protobuf::Descriptor* request);
  RequestCost(const RequestCost&) = delete;
  RequestCost& operator=(const RequestCost&) = delete;

  /// Never less than what parsing `wire` on an arena allocates, and seldom twice as much. Counting
  /// ends above `bytes_max`, and where the bytes are no message, as parsing will.
  ///
  /// Cost: linear in the bytes, about as long as parsing them.
  size_t Bytes(grpc::ByteBuffer* wire, size_t bytes_max) const;

 private:
  enum class Kind : uint8_t { kUnknown, kVarint, kFixed32, kFixed64, kText, kMessage };
  struct Type;
  struct Field {
    Kind kind = Kind::kUnknown;
    /// Of one element of a repeated field; 0 for a single number, which its message contains.
    size_t bytes = 0;
    const Type* type = nullptr;
  };
  struct Type {
    size_t bytes = 0;
    /// By number.
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
