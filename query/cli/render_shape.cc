// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_shape.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/table.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

// Source: Loper et al., "SMPL: a skinned multi-person linear model", 2015: 24 joints, hands last.
constexpr int kJointCount = 24;
constexpr int kLeftHand = 22;
constexpr int kRightHand = 23;

std::string CountText(int count) { return count == 0 ? "-" : absl::StrCat(count); }

std::string JointText(const v1::AgentShape& body, int joint) {
  const auto& joints = body.shape().joints();
  if (joints.size() != 3 * kJointCount || !body.has_pose()) return "-";
  const Eigen::Vector3d joint_agent(static_cast<double>(joints[3 * joint]),
                                    static_cast<double>(joints[3 * joint + 1]),
                                    static_cast<double>(joints[3 * joint + 2]));
  const Pose3d map_T_agent = FromProto(body.pose());
  const Eigen::Vector3d joint_map = map_T_agent * joint_agent;
  return absl::StrCat(Fixed(joint_map.x(), 2), " ", Fixed(joint_map.y(), 2), " ",
                      Fixed(joint_map.z(), 2));
}

}  // namespace

std::string RenderShapes(const v1::GetAgentShapeResponse& reply, const TimeText& times) {
  std::vector<Column> columns{{"time", Align::kRight},        {"pose", Align::kRight},
                              {"shape", Align::kRight},       {"joints", Align::kRight},
                              {"vertices", Align::kRight},    {"left hand m", Align::kRight},
                              {"right hand m", Align::kRight}};
  if (times.has_dates()) columns.push_back({"date"});
  Table table(columns);
  for (const v1::AgentShape& body : reply.shapes()) {
    const v1::BodyShape& shape = body.shape();
    std::vector<std::string> cells{times.Relative(shape.time_ns()),
                                   CountText(shape.pose_coefficients_size()),
                                   CountText(shape.shape_coefficients_size()),
                                   CountText(shape.joints_size() / 3),
                                   CountText(body.vertex_count()),
                                   JointText(body, kLeftHand),
                                   JointText(body, kRightHand)};
    if (times.has_dates()) cells.push_back(times.Date(shape.time_ns()));
    table.AddRow(std::move(cells));
  }
  return absl::StrCat(table.Render(), Counted(reply.shapes_size(), "body shape"), " of ",
                      reply.agent_id(), " (revision ", reply.header().read_revision(), ")\n");
}

}  // namespace dsg::cli
