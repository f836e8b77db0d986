// SPDX-License-Identifier: Apache-2.0
// The command line of dsg-ingest, and what it says of logs and of what is made of them.
// Part of the program, not of the library.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/program/destination.h"
#include "ingest/program/mapping_flags.h"
#include "ingest/program/odometry_flags.h"
#include "ingest/program/people_flags.h"
#include "ingest/program/segmenter_flags.h"
#include "query/client/credentials.h"

namespace CLI {
class App;
}

namespace dsg::ingest {

/// The command line.
struct IngestFlags {
  std::string store;
  std::string server;
  client::CredentialFiles credentials;
  std::string retry_for = "10m";
  SpaceLimits limits;
  std::string spill_folder;
  std::string map;
  std::string format = "auto";
  /// Unset = what the format is used to.
  std::optional<double> frame_period_s;
  std::string agent_prefix;
  bool is_strict = false;
  std::string epoch;
  std::string codec;
  std::string poses = "auto";
  std::string pose_file;
  std::string loop_file;
  std::string label_folder;
  std::vector<std::string> topics;
  bool is_followed = false;
  /// Unset = never.
  std::optional<double> follow_timeout_s;
  double follow_late_s = 1.0;
  std::string robot_cad;
  double odometry_m_per_m = RobotGraphOptions().odometry_m_per_m;
  double odometry_rad_per_m = RobotGraphOptions().odometry_rad_per_m;
  std::string up = "auto";
  std::string transform;
  int64_t commit_poses = IngestOptions().poses_per_delta;
  MappingFlags mapping;
  /// Numbers of IngestOptions::Groups alone; the rest is not used.
  IngestOptions numbers;
  OdometryFlags odometry;
  PeopleFlags people;
  SegmenterFlags segmenter;
  bool is_quiet = false;
  bool is_json = false;
  bool is_dry_run = false;
  bool tells_undone_again = false;
  std::vector<std::string> logs;
};

/// Numbers of single stages stand in groups of their own, which --help names and --help-all shows.
void AddIngestFlags(CLI::App* app, IngestFlags* flags);

/// `stop`: ends a followed log; must outlive it.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the flag.
absl::StatusOr<LogOptions> MakeLogOptions(const IngestFlags& flags, const std::atomic<bool>* stop);

/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the flag; of reading the files of CAD models and
/// of a detector.
absl::StatusOr<IngestOptions> MakeIngestOptions(const IngestFlags& flags);

}  // namespace dsg::ingest
