// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export_tum.h"

#include <algorithm>
#include <map>
#include <optional>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "dsg/v1/graph.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"
#include "schema/model/trajectory.h"

namespace dsg::cli {
namespace {

// Names of the log may hold anything; these need no quotes and stay in the folder.
bool IsPlain(const std::string& name) {
  constexpr size_t kBytesMax = 100;
  const auto is_plain = [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '.';
  };
  return !name.empty() && name.size() <= kBytesMax && name[0] != '.' && name[0] != '-' &&
         std::all_of(name.begin(), name.end(), is_plain);
}

std::string PoseLine(const v1::TimedPose& pose) {
  const v1::Vector3& p = pose.pose().position();
  v1::Quaternion q;
  q.set_w(1.0);
  const bool has_orientation = (pose.flags() & pose_flags::kNoOrientation) == 0;
  if (has_orientation && pose.pose().has_orientation()) q = pose.pose().orientation();
  return absl::StrFormat("%s %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", SecondsText(pose.time_ns()),
                         p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

std::string Heading(const MapRows& map, const AgentRow& agent) {
  return absl::StrCat("# ", Printable(absl::StrCat(agent.kind, " ", agent.id, " ", agent.name)),
                      ", map ", map.session().map().name, ", revision ", map.revision(),
                      "; seconds, metres\n# timestamp tx ty tz qx qy qz qw\n");
}

// Nothing for an agent without poses, which leaves no file.
absl::StatusOr<std::optional<Written>> WriteTrack(const MapRows& map, const AgentRow& agent,
                                                  const std::string& path, bool force) {
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, force));
  DSG_RETURN_IF_ERROR(file.Write(Heading(map, agent)));
  int64_t pose_count = 0;
  int64_t unturned_count = 0;
  DSG_RETURN_IF_ERROR(map.Poses(agent.id, [&](const v1::TimedPose& pose) {
    ++pose_count;
    if (pose.flags() & pose_flags::kNoOrientation) ++unturned_count;
    return file.Write(PoseLine(pose));
  }));
  if (pose_count == 0) return std::optional<Written>();
  DSG_RETURN_IF_ERROR(file.Commit());
  if (unturned_count > 0) {
    map.session().notes() << "note: " << Printable(path) << ": " << Counted(unturned_count, "pose")
                          << " without orientation, written as 0 0 0 1\n";
  }
  return std::optional(Written{.format = "tum",
                               .path = path,
                               .byte_count = file.byte_count(),
                               .counts = {{"poses", pose_count}}});
}

}  // namespace

std::vector<std::string> FileStems(const std::vector<AgentRow>& agents) {
  // Some file systems do not tell letters of either case apart.
  std::map<std::string, int> count_of;
  for (const AgentRow& agent : agents) {
    ++count_of[absl::AsciiStrToLower(agent.id)];
    if (agent.name != agent.id) ++count_of[absl::AsciiStrToLower(agent.name)];
  }
  std::vector<std::string> stems;
  for (const AgentRow& agent : agents) {
    const bool is_own = count_of[absl::AsciiStrToLower(agent.name)] == 1;
    stems.push_back(is_own && IsPlain(agent.name) ? agent.name : agent.id);
  }
  return stems;
}

absl::StatusOr<std::vector<Written>> WriteTumFiles(const MapRows& map, const std::string& folder,
                                                   bool force) {
  DSG_RETURN_IF_ERROR(MakeFolder("--tum", folder));
  DSG_ASSIGN_OR_RETURN(const std::vector<AgentRow> agents, map.Agents());
  std::vector<std::string> paths;
  for (const std::string& stem : FileStems(agents)) {
    paths.push_back(absl::StrCat(folder, "/", stem, ".tum"));
    DSG_RETURN_IF_ERROR(CheckMayWrite(paths.back(), force));
  }
  std::vector<Written> files;
  for (size_t i = 0; i < agents.size(); ++i) {
    DSG_ASSIGN_OR_RETURN(const auto written, WriteTrack(map, agents[i], paths[i], force));
    if (written.has_value()) files.push_back(*written);
  }
  return files;
}

}  // namespace dsg::cli
