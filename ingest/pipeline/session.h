// SPDX-License-Identifier: Apache-2.0
// The identity of one log's way into one map: what makes a second run a repetition.
#pragma once

#include <string>

#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// Everything besides the log's bytes that a log's deltas depend on.
struct SessionConfig {
  std::string format;
  TimeNs epoch_ns = 0;
  TimeNs frame_period_ns = 0;
  std::string agent_prefix;
  double mesh_block_size_m = 0.0;
  int64_t poses_per_delta = 0;
  /// Which poses of a sensor log: "auto", "gt", "external", "vio". "auto" leaves the digest as it
  /// was before there was a choice. What a pose file says is part of the log's content.
  std::string poses = "auto";
  /// IngestOptions::up; "auto" leaves the digest as it was before there was a choice.
  std::string up = "auto";
  /// IngestOptions::transform; empty for none.
  std::string transform;
  /// MappingOptions::Digest of logs that give static layers; empty for others.
  std::string mapping;
  /// PeopleOptions::Digest of logs that give people's tracks; empty for others.
  std::string people;
  /// How the robot's odometry is trusted; empty for logs without loop closures.
  std::string odometry;
  /// SHA-256 of the robot's CAD model; empty for none.
  std::string robot_model;
  /// Numbers of IngestOptions that differ from their defaults; empty = none.
  std::string tuning;
  /// Whether corrections of logs with loop closures are cut to the size of messages: then their
  /// sequences are others.
  bool is_size_bounded = false;

  /// SHA-256 in hexadecimal.
  std::string Digest() const;
};

/// "log-" and 32 hexadecimal digits over content and configuration.
std::string SessionId(const std::string& content_sha256, const SessionConfig& config);

}  // namespace dsg::ingest
