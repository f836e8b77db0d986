// SPDX-License-Identifier: Apache-2.0
#include "query/cli/verb_merge.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/json.h"
#include "query/cli/progress.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

struct MergeVerb {
  /// Name of the map to merge in.
  std::string other;
  /// Empty = estimate it.
  std::string transform;
  bool dry_run = false;
  /// Also with a doubtful transform.
  bool yes = false;
  PictureOptions picture;
};

std::string TransformText(const v1::Pose& pose) {
  const Pose3d plain = FromProto(pose);
  const Eigen::Vector3d x = plain.orientation * Eigen::Vector3d::UnitX();
  const double yaw_degrees = std::atan2(x.y(), x.x()) * 180.0 / std::numbers::pi;
  return absl::StrCat(Fixed(plain.position.x(), 3), ",", Fixed(plain.position.y(), 3), ",",
                      Fixed(plain.position.z(), 3), " turned by ", Fixed(yaw_degrees, 2),
                      " degrees");
}

std::string MergeEndText(const v1::MergeMapsResponse& reply, bool is_dry_run) {
  if (is_dry_run) return "nothing was written (--dry-run)\n";
  if (reply.revision() == 0) return "nothing is new: the map has everything already\n";
  return absl::StrCat("revision ", reply.revision(), "\n");
}

// A wrong transform can make fewer things than this agree by chance.
constexpr int kFewThings = 8;
// Limits beyond which a transform is doubtful; see schema/merge/align.h.
constexpr double kAgreeingShareMin = 0.25;
constexpr double kBlockedShareMax = 0.15;

constexpr char kWhatToDo[] =
    "; draw both with --dry-run --png FILE, and give the transform with --transform X,Y,Z,YAW "
    "(metres, radians)";

// The share that both maps have of what both could have observed.
double AgreeingShare(const v1::MergeMapsResponse& plan) {
  const double agreeing = plan.agreeing_count();
  return agreeing / std::max(1.0, agreeing + 0.5 * plan.missing_count());
}

}  // namespace

std::string DoubtsOf(const v1::MergeMapsResponse& plan, const MergeAsked& asked) {
  // Without new nodes nothing can be duplicated.
  if (plan.added_node_count() == 0) return "";
  const std::string agreeing = Counted(plan.agreeing_count(), "thing");
  if (plan.agreeing_count() == 0) {
    return absl::StrCat("nothing in ", asked.other, " agrees with ", asked.map,
                        ": the maps do not overlap, or the transform is wrong", kWhatToDo);
  }
  if (AgreeingShare(plan) < kAgreeingShareMin) {
    return absl::StrCat("there is little evidence for the transform: ", agreeing,
                        " of both maps agree, and ", plan.missing_count(),
                        " are missing where both maps have observed", kWhatToDo);
  }
  if (plan.blocked_share() > kBlockedShareMax) {
    return absl::StrCat(
        "there is strong evidence against the transform: of the places near walls of the other "
        "map, ",
        Fixed(100.0 * plan.blocked_share(), 0), " % stand in them", kWhatToDo);
  }
  if (asked.has_transform || plan.agreeing_count() >= kFewThings) return "";
  return absl::StrCat("the transform rests on ", agreeing, " only", kWhatToDo);
}

std::string RenderMerge(const v1::MergeMapsResponse& reply, const MergeAsked& asked) {
  const bool has_pairs = reply.fused_object_count() > 0;
  std::string text = RenderFields(
      {{"map", asked.map},
       {"other", asked.other},
       {"other lies at", TransformText(reply.map_t_other())},
       {"things agreeing", absl::StrCat(reply.agreeing_count())},
       {"they differ by",
        has_pairs ? absl::StrCat(Fixed(reply.residual_m(), 3), " m (root mean square)") : "-"}});
  Table table({{"", Align::kLeft}, {absl::StrCat("nodes of ", asked.other), Align::kRight}});
  const auto row = [&](const char* what, int64_t count) {
    table.AddRow({what, absl::StrCat(count)});
  };
  row("objects in both", reply.fused_object_count());
  row("places in both", reply.fused_place_count());
  row("rooms in both", reply.fused_room_count());
  row("structures in both", reply.fused_structure_count());
  row("added", reply.added_node_count());
  absl::StrAppend(&text, "\n", table.Render());
  if (reply.gone_count() > 0) {
    absl::StrAppend(&text, "\n", Counted(reply.gone_count(), "node"), " of ", asked.map,
                    " gone, and ", reply.moved_ids().size(), " of these moved\n");
  }
  // Blocks that were not changed are not worth a line.
  if (reply.fused_mesh_block_count() > 0 && reply.revision() > 0) {
    absl::StrAppend(&text, "\n", reply.fused_mesh_block_count(), " mesh blocks joined\n");
  }
  absl::StrAppend(&text, "\n", MergeEndText(reply, asked.is_dry_run));
  const std::string doubts = asked.is_dry_run ? DoubtsOf(reply, asked) : "";
  return doubts.empty() ? text : absl::StrCat(text, "\nwarning: ", doubts, "\n");
}

namespace {

constexpr uint32_t kFusedRgb = 0x2a8c4a;
constexpr uint32_t kAddedRgb = 0x1f5fbf;
constexpr uint32_t kGoneRgb = 0xc8321e;
constexpr uint32_t kMovedRgb = 0xc87a1e;
// Rooms of this map and of the other one.
constexpr uint32_t kMineRgb = 0x303030;
constexpr uint32_t kTheirsRgb = 0x8a2bb0;

// "X,Y,Z,YAW", or a pose with a quaternion.
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

absl::StatusOr<v1::ListNodesResponse> NodesOfKind(Session* session, const std::string& map,
                                                  const char* kind) {
  v1::ListNodesRequest request;
  request.set_map(map);
  request.mutable_filter()->set_kind(kind);
  v1::ListNodesResponse all;
  DSG_RETURN_IF_ERROR(session->ReadPages(&query::Api::ListNodes, request, 0,
                                         &v1::ListNodesResponse::nodes_size, &all));
  return all;
}

struct SeenNodes {
  v1::ListNodesResponse objects;
  /// The area that the map covers: rooms, or places of a map without rooms.
  v1::ListNodesResponse spaces;
};

absl::StatusOr<SeenNodes> SeenBy(Session* session, const std::string& map) {
  SeenNodes seen;
  DSG_ASSIGN_OR_RETURN(seen.objects, NodesOfKind(session, map, "object"));
  DSG_ASSIGN_OR_RETURN(seen.spaces, NodesOfKind(session, map, "room"));
  if (seen.spaces.nodes().empty()) {
    DSG_ASSIGN_OR_RETURN(seen.spaces, NodesOfKind(session, map, "place"));
  }
  return seen;
}

// Rooms of both maps, and their objects by what the merge does with them.
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

// The last message, with the ids of all messages.
absl::StatusOr<v1::MergeMapsResponse> CallMerge(Session* session,
                                                const v1::MergeMapsRequest& request) {
  v1::MergeMapsResponse last;
  DSG_RETURN_IF_ERROR(
      ReadLong(session, absl::StrCat("merge ", request.other(), " into ", request.map()),
               &query::Api::MergeMaps, request, [&](const v1::MergeMapsResponse& message) {
                 auto ids = std::move(*last.mutable_node_ids());
                 last = message;
                 for (const auto& [before, after] : ids) (*last.mutable_node_ids())[before] = after;
               }));
  return last;
}

// Asks on a terminal whether to use a doubtful transform; a script gets an error.
absl::Status ConfirmMerge(const std::string& doubts, bool is_confirmed, std::ostream& questions) {
  if (doubts.empty()) return absl::OkStatus();
  if (!is_confirmed && isatty(STDIN_FILENO) == 0) {
    return MakeError(Reason::kNoRegistration, absl::StrCat("refused without --yes: ", doubts));
  }
  questions << "dsg: warning: " << doubts << "\n" << std::flush;
  if (is_confirmed) return absl::OkStatus();
  questions << "Merge anyway? [y/N] " << std::flush;
  std::string answer;
  if (std::getline(std::cin, answer) && (answer == "y" || answer == "yes")) return absl::OkStatus();
  return MakeError(Reason::kNoRegistration, "nothing was written: the transform was not confirmed");
}

// A dry run comes first, so that doubts are known before anything is written.
absl::StatusOr<v1::MergeMapsResponse> PlanAndWrite(Session* session, const MergeAsked& asked,
                                                   bool is_confirmed,
                                                   v1::MergeMapsRequest request) {
  request.set_dry_run(true);
  DSG_ASSIGN_OR_RETURN(v1::MergeMapsResponse plan, CallMerge(session, request));
  if (asked.is_dry_run) return plan;
  DSG_RETURN_IF_ERROR(ConfirmMerge(DoubtsOf(plan, asked), is_confirmed, session->notes()));
  request.set_dry_run(false);
  *request.mutable_map_t_other() = plan.map_t_other();
  DSG_ASSIGN_OR_RETURN(v1::MergeMapsResponse last, CallMerge(session, request));
  last.set_agreeing_count(plan.agreeing_count());
  return last;
}

absl::Status RunMerge(Session* session, const MergeVerb& verb, std::ostream& out) {
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
                       PlanAndWrite(session, asked, verb.yes, request));
  if (session->common().json) {
    if (verb.dry_run && !DoubtsOf(last, asked).empty()) {
      session->notes() << "dsg: warning: " << DoubtsOf(last, asked) << "\n";
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

}  // namespace

void AddMergeVerb(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<MergeVerb>({.name = "merge",
                               .what = "Merge another map of the same place into this one",
                               .example = "office-later --dry-run --png both.png",
                               .takes = kServer | kMap | kJson,
                               .run = RunMerge});
  app->add_option("OTHER", verb->other, "The map to merge in; it does not change")->required();
  app->add_option("--transform", verb->transform,
                  "X,Y,Z,YAW or X,Y,Z,QX,QY,QZ,QW: takes points of OTHER into the map, metres and "
                  "radians; default estimated from what both maps have observed");
  app->add_flag("--dry-run", verb->dry_run, "Only report what would change");
  app->add_flag("--yes", verb->yes, "Do not ask about a doubtful transform");
  AddPicture(app, "what is in both maps, added and gone", &verb->picture);
}

}  // namespace dsg::cli
