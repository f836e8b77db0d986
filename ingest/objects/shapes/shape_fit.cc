// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/shape_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/match.h"
#include "ingest/objects/shapes/alignment.h"
#include "ingest/objects/shapes/keypoints.h"
#include "ingest/objects/shapes/model_index.h"
#include "ingest/objects/shapes/pose_starts.h"
#include "ingest/objects/shapes/surface.h"
#include "schema/matching/registration.h"

namespace dsg::ingest {

struct FittedModel {
  int index = -1;
  std::string class_name;
  ModelIndex surface;
  std::vector<Eigen::Vector3d> keypoints;
  // For the test of free space.
  std::vector<Eigen::Vector3d> probes;
};

namespace {

using FreeTest = std::function<bool(const Eigen::Vector3d&)>;

constexpr int kSampleCount = 60'000;
constexpr double kSurfaceM = 0.025;
constexpr double kOuterCellM = 0.04;
constexpr double kOuterCellCountMax = 2e6;
// The distance of the inlier share, and of the cost that ranks poses.
constexpr double kInlierM = 0.1;
constexpr size_t kFitPointCountMin = 10;
constexpr size_t kFitPointCountMax = 4000;
constexpr double kCoordinateMaxM = 1e6;
constexpr size_t kStartCount = 40;
constexpr size_t kCandidateCount = 8;
constexpr size_t kFinalistCount = 3;
// Around the best poses: something beside the object (a table before a couch) pulls a pose off by
// this much, and a tight gate from a start beyond lets go of it.
constexpr size_t kShakenCount = 3;
constexpr double kShakeM = 0.1;
constexpr double kShakeRad = 8.0 * std::numbers::pi / 180.0;
constexpr size_t kRoughPointCount = 250;
constexpr size_t kFreeTestCount = 400;
// Space counts as free where it is free this far around: a pose that is off by less, at the edge
// of what a camera saw past, is not yet contradicted.
constexpr double kFreeAroundM = 0.1;
// How far off the floor's height an object may stand.
constexpr double kFloorToleranceM = 0.05;
// What a share of surface in free space, and a share of surface explained, weighs against the
// share of points that are off the model.
constexpr double kFreeWeight = 1.0;
constexpr double kCoveredWeight = 0.1;

// A pose with all that speaks for and against it.
struct Candidate {
  Pose3d map_T_model;
  Explanation explanation;
  double free_share = 0.0;

  double score() const {
    return explanation.cost + kFreeWeight * free_share - kCoveredWeight * explanation.covered_share;
  }
};

double OuterCell(const CadModel& cad) {
  Box3d box;
  double doubled_area = 0.0;
  for (const auto& [a, b, c] : cad.faces) {
    for (const uint32_t corner : {a, b, c}) box.extend(cad.vertices[corner]);
    doubled_area +=
        (cad.vertices[b] - cad.vertices[a]).cross(cad.vertices[c] - cad.vertices[a]).norm();
  }
  const Eigen::Vector3d sizes = box.sizes() + Eigen::Vector3d::Constant(4.0 * kOuterCellM);
  return std::max({kOuterCellM, std::sqrt(4.0 * doubled_area / kSampleCount),
                   std::cbrt(sizes.prod() / kOuterCellCountMax)});
}

KeypointOptions KeypointsOf(const ShapeOptions& options) {
  KeypointOptions out;
  out.radius_m = options.keypoint_radius_m;
  out.threshold = options.keypoint_threshold;
  out.count_max = options.keypoint_count_max;
  return out;
}

FittedModel MakeModel(int index, const CadModel& cad, const ShapeOptions& options) {
  const Surface outer = KeepOuter(SampleFaces(cad, kSampleCount), OuterCell(cad));
  FittedModel model{index, cad.class_name, ModelIndex(ThinSurface(outer, kSurfaceM)), {}, {}};
  model.keypoints =
      FindKeypoints(ThinPoints(outer.points, options.point_distance_m), KeypointsOf(options));
  model.probes = EveryNth(ThinSurface(outer, options.point_distance_m).points, kFreeTestCount);
  return model;
}

std::vector<Eigen::Vector3d> CleanPoints(const std::vector<Eigen::Vector3f>& points_map,
                                         double distance_m) {
  std::vector<Eigen::Vector3d> finite;
  for (const Eigen::Vector3f& point : points_map) {
    const Eigen::Vector3d wide = point.cast<double>();
    if (wide.allFinite() && wide.cwiseAbs().maxCoeff() < kCoordinateMaxM) finite.push_back(wide);
  }
  return EveryNth(ThinPoints(finite, distance_m), kFitPointCountMax);
}

bool IsFreeAround(const FreeTest& is_free, const Eigen::Vector3d& point_map) {
  if (!is_free(point_map)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kFreeAroundM * Eigen::Vector3d::Unit(axis);
    if (!is_free(point_map + step) || !is_free(point_map - step)) return false;
  }
  return true;
}

// Height that all but a few stray points lie above.
double LowestOf(const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> heights;
  for (const Eigen::Vector3d& point : points) heights.push_back(point.z());
  const auto at = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 50);
  std::nth_element(heights.begin(), at, heights.end());
  return *at;
}

}  // namespace

class ShapeFitter::Impl {
 public:
  Impl(const std::vector<CadModel>& catalogue, const ShapeOptions& options) : options_(options) {
    for (size_t i = 0; i < catalogue.size(); ++i) {
      if (catalogue[i].faces.empty()) continue;
      models_.push_back(MakeModel(static_cast<int>(i), catalogue[i], options));
    }
  }

  std::optional<ShapeFit> Fit(const std::string& class_name,
                              const std::vector<Eigen::Vector3f>& points_map,
                              const FreeTest& is_free, std::optional<double> floor_z_map) const {
    std::vector<const FittedModel*> models;
    for (const FittedModel& model : models_) {
      if (absl::EqualsIgnoreCase(model.class_name, class_name)) models.push_back(&model);
    }
    if (models.empty()) return std::nullopt;
    const std::vector<Eigen::Vector3d> points = CleanPoints(points_map, options_.point_distance_m);
    if (points.size() < kFitPointCountMin) return std::nullopt;
    const std::vector<Eigen::Vector3d> keypoints = FindKeypoints(points, KeypointsOf(options_));
    std::optional<ShapeFit> best;
    double best_score = 0.0;
    for (const FittedModel* model : models) {
      for (const Candidate& candidate :
           FindCandidates(*model, points, keypoints, is_free, floor_z_map)) {
        if (!IsAccepted(candidate) || (best && candidate.score() >= best_score)) continue;
        best_score = candidate.score();
        best = ShapeFit{model->index, candidate.map_T_model, candidate.explanation.residual_m,
                        candidate.explanation.inlier_share, candidate.free_share};
      }
    }
    return best;
  }

 private:
  bool IsAccepted(const Candidate& candidate) const {
    return candidate.explanation.inlier_share >= options_.inlier_share_min &&
           candidate.free_share <= options_.free_share_max;
  }

  // The paper's step: all keypoints of the one with all of the other.
  std::optional<Pose3d> Match(const FittedModel& model,
                              const std::vector<Eigen::Vector3d>& keypoints,
                              double floor_z_map) const {
    std::vector<Correspondence> pairs =
        AllToAll(static_cast<int>(model.keypoints.size()), static_cast<int>(keypoints.size()));
    RegistrationOptions registration;
    registration.noise_bound_m = options_.noise_bound_m;
    registration.is_upright = options_.is_upright && !options_.is_paper;
    if (registration.is_upright) {
      std::erase_if(pairs, [&](const Correspondence& pair) {
        const double height_model = model.keypoints[static_cast<size_t>(pair.first)].z();
        const double height = keypoints[static_cast<size_t>(pair.second)].z() - floor_z_map;
        return std::abs(height - height_model) > 2.0 * options_.noise_bound_m;
      });
    }
    const absl::StatusOr<Registration> found =
        Register(model.keypoints, keypoints, pairs, registration);
    // No agreement is no error here: the other starts remain.
    if (!found.ok()) return std::nullopt;
    return Pose3d{found->translation, Eigen::Quaterniond(found->rotation).normalized()};
  }

  Candidate Judge(const FittedModel& model, const std::vector<Eigen::Vector3d>& points,
                  const Pose3d& map_T_model, const FreeTest& is_free, bool is_exact) const {
    Candidate out;
    out.map_T_model = map_T_model;
    out.explanation = Explain(model.surface, points, map_T_model, kInlierM, is_exact);
    if (!is_free) return out;
    const auto free_count = std::count_if(
        model.probes.begin(), model.probes.end(),
        [&](const Eigen::Vector3d& probe) { return IsFreeAround(is_free, map_T_model * probe); });
    out.free_share = static_cast<double>(free_count) / static_cast<double>(model.probes.size());
    return out;
  }

  std::vector<Candidate> FindCandidates(const FittedModel& model,
                                        const std::vector<Eigen::Vector3d>& points,
                                        const std::vector<Eigen::Vector3d>& keypoints,
                                        const FreeTest& is_free,
                                        std::optional<double> floor_z_map) const {
    const std::optional<Pose3d> matched =
        Match(model, keypoints, floor_z_map ? *floor_z_map : LowestOf(points));
    if (options_.is_paper) {
      if (!matched) return {};
      return {Judge(model, points, *matched, is_free, true)};
    }
    std::vector<Start> starts = FindStarts(model.surface, points, floor_z_map, kStartCount);
    if (matched) starts.push_back({*matched, 0.0});
    const std::vector<Start> rough = AlignRoughly(model, points, std::move(starts));
    return Refine(model, points, rough, is_free, floor_z_map);
  }

  std::vector<Start> AlignRoughly(const FittedModel& model,
                                  const std::vector<Eigen::Vector3d>& points,
                                  std::vector<Start> starts) const {
    const std::vector<Eigen::Vector3d> few = EveryNth(points, kRoughPointCount);
    AlignmentOptions options;
    options.is_upright = options_.is_upright;
    AlignAll(model, few, options, &starts);
    starts = KeepDistinct(starts, kCandidateCount);
    for (size_t i = std::min(starts.size(), kShakenCount); i-- > 0;) Shake(starts[i], &starts);
    options.gate_first_m = 0.15;
    options.gate_last_m = 0.08;
    AlignAll(model, few, options, &starts);
    return KeepDistinct(starts, kCandidateCount);
  }

  // Leaves the starts ascending by cost.
  static void AlignAll(const FittedModel& model, const std::vector<Eigen::Vector3d>& points,
                       const AlignmentOptions& options, std::vector<Start>* starts) {
    for (Start& start : *starts) {
      start.map_T_model = Align(model.surface, points, start.map_T_model, options);
      const Explanation explanation =
          Explain(model.surface, points, start.map_T_model, kInlierM, false);
      start.cost = explanation.cost - kCoveredWeight * explanation.covered_share;
    }
    std::stable_sort(starts->begin(), starts->end(),
                     [](const Start& a, const Start& b) { return a.cost < b.cost; });
  }

  // Appends poses turned and moved a little on the floor.
  static void Shake(const Start& start, std::vector<Start>* starts) {
    for (const double turn : {-kShakeRad, 0.0, kShakeRad}) {
      for (const auto& [x, y] :
           {std::pair(0.0, 0.0), std::pair(kShakeM, 0.0), std::pair(-kShakeM, 0.0),
            std::pair(0.0, kShakeM), std::pair(0.0, -kShakeM)}) {
        const Pose3d change{{x, y, 0.0},
                            Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()))};
        starts->push_back({start.map_T_model * change, 1.0});
      }
    }
  }

  std::vector<Candidate> Refine(const FittedModel& model,
                                const std::vector<Eigen::Vector3d>& points,
                                const std::vector<Start>& starts, const FreeTest& is_free,
                                std::optional<double> floor_z_map) const {
    std::vector<Candidate> candidates;
    for (const Start& start : starts) {
      candidates.push_back(Judge(model, points, start.map_T_model, is_free, false));
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score() < b.score(); });
    if (candidates.size() > kFinalistCount) candidates.resize(kFinalistCount);
    AlignmentOptions options;
    options.is_upright = options_.is_upright;
    options.is_exact = true;
    options.iteration_count_max = 15;
    options.gate_first_m = kInlierM;
    options.gate_last_m = 0.07;
    for (Candidate& candidate : candidates) {
      Pose3d pose = Align(model.surface, points, candidate.map_T_model, options);
      if (floor_z_map) {
        pose.position.z() = std::clamp(pose.position.z(), *floor_z_map - kFloorToleranceM,
                                       *floor_z_map + kFloorToleranceM);
      }
      candidate = Judge(model, points, pose, is_free, true);
    }
    return candidates;
  }

  ShapeOptions options_;
  std::vector<FittedModel> models_;
};

ShapeFitter::ShapeFitter(const std::vector<CadModel>& catalogue, const ShapeOptions& options)
    : impl_(std::make_unique<Impl>(catalogue, options)) {}
ShapeFitter::~ShapeFitter() = default;
ShapeFitter::ShapeFitter(ShapeFitter&&) noexcept = default;
ShapeFitter& ShapeFitter::operator=(ShapeFitter&&) noexcept = default;

std::optional<ShapeFit> ShapeFitter::Fit(const std::string& class_name,
                                         const std::vector<Eigen::Vector3f>& points_map,
                                         const FreeTest& is_free,
                                         std::optional<double> floor_z_map) const {
  return impl_->Fit(class_name, points_map, is_free, floor_z_map);
}

}  // namespace dsg::ingest
