// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/session.h"

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"

namespace dsg::ingest {
namespace {

// Counts changes of what the pipeline makes of a log; a half-done session of an older build must
// not be continued with other deltas.
constexpr int kPipelineVersion = 2;

}  // namespace

std::string SessionConfig::Digest() const {
  std::string choice = poses == "auto" ? "" : absl::StrCat("poses=", poses, "\n");
  if (up != "auto") absl::StrAppend(&choice, "up=", up, "\n");
  if (!transform.empty()) absl::StrAppend(&choice, "transform=", transform, "\n");
  if (!mapping.empty()) absl::StrAppend(&choice, "mapping=", mapping, "\n");
  if (!people.empty()) absl::StrAppend(&choice, "people=", people, "\n");
  if (!odometry.empty()) absl::StrAppend(&choice, "odometry=", odometry, "\n");
  if (!robot_model.empty()) absl::StrAppend(&choice, "robot_model=", robot_model, "\n");
  if (!tuning.empty()) absl::StrAppend(&choice, "tuning=", tuning, "\n");
  if (is_size_bounded) absl::StrAppend(&choice, "bounded\n");
  return Sha256Hex(
      absl::StrCat(choice, "pipeline=", kPipelineVersion, "\nformat=", format,
                   "\nepoch_ns=", epoch_ns, "\nframe_period_ns=", frame_period_ns,
                   "\nmesh_block_size_um=", static_cast<int64_t>(mesh_block_size_m * 1e6),
                   "\nposes_per_delta=", poses_per_delta, "\nagent_prefix=", agent_prefix, "\n"));
}

std::string SessionId(const std::string& content_sha256, const SessionConfig& config) {
  return absl::StrCat("log-",
                      Sha256Hex(absl::StrCat(content_sha256, "\n", config.Digest())).substr(0, 32));
}

}  // namespace dsg::ingest
