// SPDX-License-Identifier: Apache-2.0
// The verb merge: another map of the same place, taken into this one.
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/interrupt.h"
#include "query/cli/json.h"
#include "query/cli/paging.h"
#include "query/cli/progress.h"
#include "query/cli/render_merge.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

constexpr uint32_t kFusedRgb = 0x2a8c4a;
constexpr uint32_t kAddedRgb = 0x1f5fbf;
constexpr uint32_t kGoneRgb = 0xc8321e;
constexpr uint32_t kMovedRgb = 0xc87a1e;
// Rooms of this map and of the other one.
constexpr uint32_t kMineRgb = 0x303030;
constexpr uint32_t kTheirsRgb = 0x8a2bb0;

// "X,Y,Z,YAW" besides what ParsePose takes.
absl::StatusOr<Pose3d> ParseTransform(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ',');
  if (parts.size() == 7) return ParsePose("--transform", text);
  if (parts.size() != 4) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("--transform \"", text, "\" has ", parts.size(),
                                  " numbers; write X,Y,Z,YAW or X,Y,Z,QX,QY,QZ,QW, in metres and "
                                  "radians"),
                     {{"field", "--transform"}, {"value", text}});
  }
  DSG_ASSIGN_OR_RETURN(
      const Eigen::Vector3d shift,
      ParsePoint("--transform", absl::StrCat(parts[0], ",", parts[1], ",", parts[2])));
  DSG_ASSIGN_OR_RETURN(const Eigen::Vector3d yaw,
                       ParsePoint("--transform", absl::StrCat(parts[3], ",0,0")));
  return Pose3d{shift, Eigen::Quaterniond(Eigen::AngleAxisd(yaw.x(), Eigen::Vector3d::UnitZ()))};
}

absl::StatusOr<v1::ListNodesResponse> NodesOf(Session* session, const std::string& map,
                                              const char* kind) {
  v1::ListNodesRequest request;
  request.set_map(map);
  request.mutable_filter()->set_kind(kind);
  v1::ListNodesResponse all;
  DSG_RETURN_IF_ERROR(FetchPages(
      request, 0, [](const v1::ListNodesResponse& page) { return page.nodes_size(); },
      [&](const v1::ListNodesRequest& ask, v1::ListNodesResponse* page) {
        return session->api().ListNodes(session->NewCall(), ask, page);
      },
      &all));
  return all;
}

struct SeenNodes {
  v1::ListNodesResponse objects;
  /// Rooms, or places of a map without rooms: where it has been.
  v1::ListNodesResponse spaces;
};

absl::StatusOr<SeenNodes> SeenBy(Session* session, const std::string& map) {
  SeenNodes seen;
  DSG_ASSIGN_OR_RETURN(seen.objects, NodesOf(session, map, "object"));
  DSG_ASSIGN_OR_RETURN(seen.spaces, NodesOf(session, map, "room"));
  if (seen.spaces.nodes().empty()) {
    DSG_ASSIGN_OR_RETURN(seen.spaces, NodesOf(session, map, "place"));
  }
  return seen;
}

// Rooms of both maps, and their objects by what became of them.
class MergePicture {
 public:
  MergePicture(SeenNodes mine, SeenNodes theirs)
      : mine_(std::move(mine)), theirs_(std::move(theirs)) {}

  AnswerPicture Draw(const v1::MergeMapsResponse& reply, const std::string& map,
                     const std::string& other) {
    AnswerPicture picture{.title = absl::StrCat("with ", other)};
    picture.revision =
        reply.revision() > 0 ? reply.revision() : mine_.objects.header().read_revision();
    std::set<std::string> known;
    for (const v1::Node& node : mine_.objects.nodes()) known.insert(node.id());
    const Pose3d map_T_other = FromProto(reply.map_t_other());
    for (const v1::Node& node : mine_.spaces.nodes()) Outline(node, Pose3d(), kMineRgb);
    for (const v1::Node& node : theirs_.spaces.nodes()) Outline(node, map_T_other, kTheirsRgb);
    for (const v1::Node& node : theirs_.objects.nodes()) {
      const auto mine = reply.node_ids().find(node.id());
      const bool is_fused = mine != reply.node_ids().end() && known.contains(mine->second);
      Mark(node, map_T_other, is_fused ? kFusedRgb : kAddedRgb, OverlayMark::Shape::kDot);
    }
    const std::set<std::string> gone(reply.gone_ids().begin(), reply.gone_ids().end());
    for (const v1::Node& node : mine_.objects.nodes()) {
      if (!gone.contains(node.id())) continue;
      const bool has_moved = reply.moved_ids().contains(node.id());
      Mark(node, Pose3d(), has_moved ? kMovedRgb : kGoneRgb, OverlayMark::Shape::kCross);
    }
    overlay_.legend = {{absl::StrCat("seen by ", map), kMineRgb},
                       {absl::StrCat("seen by ", other), kTheirsRgb},
                       {absl::StrCat(reply.fused_object_count(), " objects in both"), kFusedRgb},
                       {"objects added", kAddedRgb}};
    if (reply.gone_count() > 0) {
      overlay_.legend.push_back({absl::StrCat(reply.gone_count(), " gone"), kGoneRgb});
      overlay_.legend.push_back({absl::StrCat(reply.moved_ids().size(), " moved"), kMovedRgb});
    }
    picture.overlay = std::move(overlay_);
    return picture;
  }

 private:
  void Mark(const v1::Node& node, const Pose3d& map_T_node_frame, uint32_t rgb,
            OverlayMark::Shape shape) {
    OverlayMark mark{.position_map = map_T_node_frame * PointOf(node.map_t_node().position()),
                     .rgb = rgb,
                     .shape = shape,
                     .radius_px = 5.0,
                     .label = ""};
    Outline(node, map_T_node_frame, rgb);
    overlay_.marks.push_back(std::move(mark));
  }

  void Outline(const v1::Node& node, const Pose3d& map_T_node_frame, uint32_t rgb) {
    const Eigen::Vector3d middle = map_T_node_frame * PointOf(node.map_t_node().position());
    OverlayOutline outline{{}, rgb, middle.z()};
    for (const Eigen::Vector2d& corner : OutlineOf(node)) {
      const Eigen::Vector3d at(corner.x(), corner.y(), node.map_t_node().position().z());
      outline.corners_map.push_back((map_T_node_frame * at).head<2>());
    }
    if (outline.corners_map.size() >= 3) overlay_.outlines.push_back(std::move(outline));
  }

  SeenNodes mine_;
  SeenNodes theirs_;
  Overlay overlay_;
};

// The last message, with the ids of all.
absl::StatusOr<v1::MergeMapsResponse> Call(Session* session, const v1::MergeMapsRequest& request,
                                           std::ostream& progress_out) {
  Progress progress(absl::StrCat("merge ", request.other(), " into ", request.map()),
                    &progress_out);
  query::CallContext call = session->NewCall();
  const InterruptGuard guard(&call);
  v1::MergeMapsResponse last;
  DSG_RETURN_IF_ERROR(query::ReadStream(call, session->api().MergeMaps(call, request),
                                        [&](const v1::MergeMapsResponse& message) {
                                          progress.Update(message.progress());
                                          auto ids = std::move(*last.mutable_node_ids());
                                          last = message;
                                          for (const auto& [before, after] : ids)
                                            (*last.mutable_node_ids())[before] = after;
                                          return true;
                                        }));
  return last;
}

// A person says whether a doubtful transform is meant; nobody is there to ask a script.
absl::Status Confirm(const std::string& doubts, bool is_meant, std::ostream& questions) {
  if (doubts.empty()) return absl::OkStatus();
  if (!is_meant && isatty(STDIN_FILENO) == 0) {
    return MakeError(Reason::kNoRegistration, absl::StrCat("refused without --yes: ", doubts));
  }
  questions << "dsg: warning: " << doubts << "\n" << std::flush;
  if (is_meant) return absl::OkStatus();
  questions << "Merge all the same? [y/N] " << std::flush;
  std::string answer;
  if (std::getline(std::cin, answer) && (answer == "y" || answer == "yes")) return absl::OkStatus();
  return MakeError(Reason::kNoRegistration, "nothing was written: the transform is not meant");
}

// What would become of it is looked at first: what is written stays.
absl::StatusOr<v1::MergeMapsResponse> PlanAndWrite(Session* session, const MergeAsked& asked,
                                                   bool is_meant, v1::MergeMapsRequest request,
                                                   std::ostream& progress_out) {
  request.set_dry_run(true);
  DSG_ASSIGN_OR_RETURN(v1::MergeMapsResponse plan, Call(session, request, progress_out));
  if (asked.is_dry_run) return plan;
  DSG_RETURN_IF_ERROR(Confirm(DoubtsOf(plan, asked), is_meant, progress_out));
  request.set_dry_run(false);
  *request.mutable_map_t_other() = plan.map_t_other();
  DSG_ASSIGN_OR_RETURN(v1::MergeMapsResponse last, Call(session, request, progress_out));
  last.set_agreeing_count(plan.agreeing_count());
  return last;
}

}  // namespace

absl::Status RunMerge(Session* session, const MergeVerb& verb, std::ostream& out,
                      std::ostream& progress_out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  v1::MergeMapsRequest request;
  request.set_map(session->map().name);
  request.set_other(verb.other);
  request.set_author("dsg merge");
  if (!verb.transform.empty()) {
    DSG_ASSIGN_OR_RETURN(const Pose3d transform, ParseTransform(verb.transform));
    ToProto(transform, request.mutable_map_t_other());
  }
  SeenNodes mine;
  SeenNodes theirs;
  if (!verb.picture.png.empty()) {
    DSG_ASSIGN_OR_RETURN(mine, SeenBy(session, request.map()));
    DSG_ASSIGN_OR_RETURN(theirs, SeenBy(session, request.other()));
  }
  const MergeAsked asked{session->map().name, verb.other, !verb.transform.empty(), verb.dry_run};
  DSG_ASSIGN_OR_RETURN(const v1::MergeMapsResponse last,
                       PlanAndWrite(session, asked, verb.yes, request, progress_out));
  if (session->common().json) {
    if (verb.dry_run && !DoubtsOf(last, asked).empty()) {
      progress_out << "dsg: warning: " << DoubtsOf(last, asked) << "\n";
    }
    DSG_RETURN_IF_ERROR(WriteJson(last, out));
  } else {
    out << RenderMerge(last, asked);
  }
  if (verb.picture.png.empty()) return absl::OkStatus();
  MergePicture picture(std::move(mine), std::move(theirs));
  return WritePicture(session, verb.picture, picture.Draw(last, session->map().name, verb.other),
                      out);
}

}  // namespace dsg::cli
