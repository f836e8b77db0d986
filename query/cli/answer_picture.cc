// SPDX-License-Identifier: Apache-2.0
#include "query/cli/answer_picture.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/export/map_content.h"
#include "query/cli/export/outline.h"
#include "query/cli/export/top_view.h"
#include "query/cli/json.h"
#include "query/cli/read_content.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/files/atomic_file.h"
#include "schema/picture/raster.h"

namespace dsg::cli {
namespace {

absl::Status DrawToFile(Session* session, const PictureOptions& options,
                        const AnswerPicture& picture, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(ContentAnswer answer, ReadContent(session, {.at_ns = picture.at_ns,
                                                                   .with_agents = false,
                                                                   .revision = picture.revision}));
  TopViewOptions top{.width_px = options.width_px,
                     .title = absl::StrCat(answer.content.spec.name, "  revision ",
                                           picture.revision, "  ", picture.title),
                     .overlay = picture.overlay};
  if (!options.floor.empty()) {
    DSG_ASSIGN_OR_RETURN(const HeightRange floor, ChooseFloor(answer.content, options.floor));
    KeepFloor(floor, &answer.content);
    KeepFloor(floor, &top.overlay);
    absl::StrAppend(&top.title, "  floor ", options.floor);
  }
  DSG_ASSIGN_OR_RETURN(const Written written,
                       WritePng(DrawTopView(answer.content, top), options.png, options.force));
  // What programs read has no line for people.
  const bool is_for_people =
      !session->common().json && session->common().format == ListFormat::kTable;
  if (!is_for_people) return absl::OkStatus();
  TellWritten({written}, picture.revision, /*as_json=*/false, out);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Written> WritePng(const picture::Picture& picture, const std::string& path,
                                 bool force) {
  DSG_ASSIGN_OR_RETURN(const std::string png, picture::EncodePng(picture));
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, force));
  DSG_RETURN_IF_ERROR(file.Write(png));
  DSG_RETURN_IF_ERROR(file.Commit());
  return Written{.format = "png",
                 .path = path,
                 .byte_count = file.byte_count(),
                 .counts = {{"columns", picture.width}, {"rows", picture.height}}};
}

absl::Status CheckPicture(const PictureOptions& options) {
  if (options.png.empty()) return absl::OkStatus();
  // The file is begun and dropped, which also finds missing folders and rights.
  return AtomicFile::Create(options.png, options.force).status();
}

absl::Status WritePicture(Session* session, const PictureOptions& options,
                          const AnswerPicture& picture, std::ostream& out) {
  if (options.png.empty()) return absl::OkStatus();
  const absl::Status written = DrawToFile(session, options, picture, out);
  if (written.ok()) return absl::OkStatus();
  return Annotate(written, absl::StrCat("the answer is complete, but its picture ", options.png,
                                        " was not written"));
}

absl::StatusOr<std::vector<std::vector<Eigen::Vector3d>>> WayOf(const Session& session,
                                                                const std::string& agent,
                                                                int64_t revision,
                                                                const Interval& span) {
  auto request = session.Begin<v1::GetTrajectoryRequest>();
  request.mutable_read_at()->set_exact_revision(revision);
  request.set_agent(agent);
  if (span.from_ns != kTimeMin) request.set_from_ns(span.from_ns);
  if (span.to_ns != kTimeMax) request.set_to_ns(span.to_ns);
  std::vector<std::vector<Eigen::Vector3d>> pieces;
  TimeNs last_ns = kTimeMin;
  const auto take = [&](const v1::GetTrajectoryResponse& message) {
    for (const v1::TimedPose& pose : message.poses()) {
      if (pieces.empty() || pose.time_ns() - last_ns > session.map().gap_ns_max) {
        pieces.emplace_back();
      }
      pieces.back().push_back(PointOf(pose.pose().position()));
      last_ns = pose.time_ns();
    }
    return true;
  };
  DSG_RETURN_IF_ERROR(session.Read(&query::Api::GetTrajectory, request, take));
  return pieces;
}

Eigen::Vector3d PointOf(const v1::Vector3& point) { return {point.x(), point.y(), point.z()}; }

Polygon2d OutlineOf(const v1::Node& node) {
  // The outline does not depend on the layer, and layers of the map are unknown here.
  v1::Node bare = node;
  bare.set_layer("objects");
  const auto plain = FromProto(bare, LayerTable());
  return plain.ok() ? FloorOutline(*plain) : Polygon2d();
}

Polygon2d EllipseOf(const Eigen::Vector2d& middle, const Eigen::Matrix2d& covariance) {
  constexpr int kCornerCount = 48;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(covariance);
  const Eigen::Vector2d radii = axes.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  Polygon2d corners;
  for (int i = 0; i < kCornerCount; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kCornerCount;
    const Eigen::Vector2d circle(std::cos(angle), std::sin(angle));
    corners.push_back(middle + axes.eigenvectors() * radii.cwiseProduct(circle));
  }
  return corners;
}

void MarkNode(const v1::Node& node, uint32_t rgb, const std::string& label, Overlay* overlay) {
  // In a gap of its track nobody knows where an agent was.
  if (!node.has_map_t_node()) return;
  OverlayMark mark{.position_map = PointOf(node.map_t_node().position()),
                   .rgb = rgb,
                   .radius_px = 10.0,
                   .label = label};
  // The box of a place is the free space around it.
  Polygon2d outline = node.kind() == kinds::kPlace ? Polygon2d() : OutlineOf(node);
  const double height_m = mark.position_map.z();
  if (outline.size() >= 3) overlay->outlines.push_back({std::move(outline), rgb, height_m});
  const absl::StatusOr<NodeId> id = ParseNodeId(node.id());
  if (id.ok() && !label.empty()) overlay->named.insert(*id);
  overlay->marks.push_back(std::move(mark));
}

}  // namespace dsg::cli
