// SPDX-License-Identifier: Apache-2.0
// A bag that appears whole or not at all, written through librosbag-storage without exceptions.
// Refuses to know what the messages mean.
#pragma once

#include <rosbag/bag.h>

#include <boost/make_shared.hpp>
#include <cerrno>
#include <exception>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/simulator/bag/bag_writer.h"
#include "schema/base/time.h"

namespace dsg::simulator {

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED when a bag cannot hold the stamp: 32 bits of seconds,
/// zero meaning "no time".
absl::StatusOr<ros::Time> ToRosTime(TimeNs time_ns);

/// Writes to PATH.part and renames on Commit(); removes PATH.part when dropped before.
///
/// Threads: one caller at a time.
class BagOutput {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the path and what the system says.
  static absl::StatusOr<std::unique_ptr<BagOutput>> Create(const std::string& path,
                                                           BagCompression compression);
  ~BagOutput();
  BagOutput(const BagOutput&) = delete;
  BagOutput& operator=(const BagOutput&) = delete;

  /// Errors: RESOURCE_EXHAUSTED/DISK_FULL; UNAVAILABLE.
  template <class Message>
  absl::Status Write(const std::string& topic, const ros::Time& stamp, const Message& message) {
    return Guard("write", [&] { bag_->write(topic, stamp, message); });
  }
  /// For topics whose last message a late listener is to get.
  template <class Message>
  absl::Status WriteLatched(const std::string& topic, const ros::Time& stamp,
                            const Message& message) {
    return Guard("write", [&] { bag_->write(topic, stamp, message, LatchedHeader<Message>()); });
  }
  /// Syncs and renames. The last call.
  absl::Status Commit();

 private:
  BagOutput(std::string path, int descriptor);

  template <class Message>
  static boost::shared_ptr<ros::M_string> LatchedHeader() {
    auto header = boost::make_shared<ros::M_string>();
    (*header)["type"] = ros::message_traits::DataType<Message>::value();
    (*header)["md5sum"] = ros::message_traits::MD5Sum<Message>::value();
    (*header)["message_definition"] = ros::message_traits::Definition<Message>::value();
    // Not by assignment, of which g++ 12 at -O3 wrongly says that it overlaps.
    header->emplace("latching", "1");
    return header;
  }
  template <class Action>
  absl::Status Guard(const char* what, const Action& action) {
    errno = 0;
    try {
      action();
    } catch (const std::exception& error) {
      return Failure(what, errno, error.what());
    }
    return absl::OkStatus();
  }
  absl::Status Failure(const char* what, int error, const std::string& detail) const;
  void Discard();

  std::string path_;
  std::string part_path_;
  // Our own handle on the file: the library has no way to sync or to cut it.
  int descriptor_ = -1;
  std::unique_ptr<rosbag::Bag> bag_;
};

}  // namespace dsg::simulator
