// SPDX-License-Identifier: Apache-2.0
// The fields of one ROS message, one after another, as ROS 1 or CDR serialises them.
#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "ingest/log/ros_messages.h"

namespace dsg::ingest {

/// Past the end it gives zeros and empty texts, and End() says so.
class RosFields {
 public:
  explicit RosFields(const RosBytes& message);
  RosFields(const RosFields&) = delete;
  RosFields& operator=(const RosFields&) = delete;

  uint8_t U8();
  uint32_t U32();
  double F64();
  /// Views into the message.
  std::string_view String();
  std::string_view Bytes();
  RosHeader Header();
  Eigen::Vector3d Vector3();
  Eigen::Vector4d Vector4();
  void SkipDoubles(int count);

  /// Bytes that are left.
  size_t rest() const;
  bool is_cut() const { return is_cut_; }
  /// Errors: FILE_MALFORMED naming `origin` and `type` when fields were missing.
  absl::Status NotCut(const char* type, const std::string& origin) const;
  /// The same, and when bytes are left over, besides what CDR may pad.
  absl::Status End(const char* type, const std::string& origin) const;

 private:
  template <typename T>
  T Get();
  std::string_view Take(uint64_t size);

  RosEncoding encoding_;
  /// Of ROS 1.
  std::string_view rest_;
  /// Of CDR, without its header of four bytes, which says the order of bytes.
  std::string_view body_;
  int representation_ = 0;
  eprosima::fastcdr::FastBuffer buffer_;
  std::optional<eprosima::fastcdr::Cdr> cdr_;
  bool is_cut_ = false;
};

}  // namespace dsg::ingest
