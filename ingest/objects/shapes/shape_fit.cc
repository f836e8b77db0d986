// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/shape_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
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

// How finely models are sampled, to tell outside from inside: memory and time, no options.
constexpr int kSampleCount = 60'000;
constexpr double kOuterCellM = 0.04;
constexpr double kOuterCellCountMax = 2e6;
// Refuses what no index can hold.
constexpr double kCoordinateMaxM = 1e6;

// A pose with all that speaks for and against it.
struct Candidate {
  Pose3d map_T_model;
  Explanation explanation;
  double free_share = 0.0;

  double ScoreBy(const ShapeOptions& options) const {
    return explanation.cost + options.free_weight * free_share -
           options.covered_weight * explanation.covered_share;
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
  out.count_min = options.keypoint_count_min;
  return out;
}

// Those that faces have, each once.
std::vector<Eigen::Vector3d> UsedVertices(const CadModel& cad) {
  std::set<uint32_t> used;
  for (const auto& [a, b, c] : cad.faces) used.insert({a, b, c});
  std::vector<Eigen::Vector3d> vertices;
  for (const uint32_t index : used) vertices.push_back(cad.vertices[index]);
  return vertices;
}

FittedModel MakeModel(int index, const CadModel& cad, const ShapeOptions& options) {
  const Surface outer = KeepOuter(SampleFaces(cad, kSampleCount), OuterCell(cad));
  FittedModel model{index,
                    cad.class_name,
                    ModelIndex(ThinSurface(outer, options.surface_m), options.patch_m),
                    {},
                    {}};
  model.keypoints = FindKeypoints(
      options.is_paper ? UsedVertices(cad) : ThinPoints(outer.points, options.point_distance_m),
      KeypointsOf(options));
  model.probes = EveryNth(ThinSurface(outer, options.point_distance_m).points,
                          static_cast<size_t>(options.free_point_count));
  return model;
}

std::vector<Eigen::Vector3d> CleanPoints(const std::vector<Eigen::Vector3f>& points_map,
                                         const ShapeOptions& options) {
  std::vector<Eigen::Vector3d> finite;
  for (const Eigen::Vector3f& point : points_map) {
    const Eigen::Vector3d wide = point.cast<double>();
    if (wide.allFinite() && wide.cwiseAbs().maxCoeff() < kCoordinateMaxM) finite.push_back(wide);
  }
  return EveryNth(options.is_paper ? finite : ThinPoints(finite, options.point_distance_m),
                  static_cast<size_t>(options.point_count_max));
}

bool IsFreeAround(const FreeTest& is_free, const Eigen::Vector3d& point_map, double around_m) {
  if (!is_free(point_map)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = around_m * Eigen::Vector3d::Unit(axis);
    if (!is_free(point_map + step) || !is_free(point_map - step)) return false;
  }
  return true;
}

// Height that all but a few stray points lie above.
double LowestOf(const std::vector<Eigen::Vector3d>& points, double stray_share) {
  std::vector<double> heights;
  for (const Eigen::Vector3d& point : points) heights.push_back(point.z());
  const double below = stray_share * static_cast<double>(heights.size());
  const auto at = heights.begin() + static_cast<std::ptrdiff_t>(below);
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
    const std::vector<Eigen::Vector3d> points = CleanPoints(points_map, options_);
    if (std::ssize(points) < options_.point_count_min) return std::nullopt;
    const std::vector<Eigen::Vector3d> keypoints = FindKeypoints(points, KeypointsOf(options_));
    std::optional<ShapeFit> best;
    double best_score = 0.0;
    for (const FittedModel* model : models) {
      for (const Candidate& candidate :
           FindCandidates(*model, points, keypoints, is_free, floor_z_map)) {
        const double score = candidate.ScoreBy(options_);
        if (!IsAccepted(candidate) || (best && score >= best_score)) continue;
        best_score = score;
        best = ShapeFit{model->index, candidate.map_T_model, candidate.explanation.residual_m,
                        candidate.explanation.inlier_share, candidate.free_share};
      }
    }
    return best;
  }

 private:
  bool IsAccepted(const Candidate& candidate) const {
    return options_.is_paper || (candidate.explanation.inlier_share >= options_.inlier_share_min &&
                                 candidate.free_share <= options_.free_share_max);
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
        // Both corners are off.
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
    out.explanation = Explain(model.surface, points, map_T_model, options_.inlier_m, is_exact);
    if (!is_free) return out;
    const auto free_count =
        std::count_if(model.probes.begin(), model.probes.end(), [&](const Eigen::Vector3d& probe) {
          return IsFreeAround(is_free, map_T_model * probe, options_.free_around_m);
        });
    out.free_share = static_cast<double>(free_count) / static_cast<double>(model.probes.size());
    return out;
  }

  std::vector<Candidate> FindCandidates(const FittedModel& model,
                                        const std::vector<Eigen::Vector3d>& points,
                                        const std::vector<Eigen::Vector3d>& keypoints,
                                        const FreeTest& is_free,
                                        std::optional<double> floor_z_map) const {
    const std::optional<Pose3d> matched = Match(
        model, keypoints, floor_z_map ? *floor_z_map : LowestOf(points, options_.stray_share));
    if (options_.is_paper) {
      if (!matched) return {};
      return {Judge(model, points, *matched, is_free, true)};
    }
    std::vector<Start> starts =
        FindStarts(model.surface, points, floor_z_map, static_cast<size_t>(options_.start_count),
                   options_.starts);
    if (matched) starts.push_back({*matched, 0.0});
    const std::vector<Start> rough = AlignRoughly(model, points, std::move(starts));
    return Refine(model, points, rough, is_free, floor_z_map);
  }

  std::vector<Start> AlignRoughly(const FittedModel& model,
                                  const std::vector<Eigen::Vector3d>& points,
                                  std::vector<Start> starts) const {
    const std::vector<Eigen::Vector3d> few =
        EveryNth(points, static_cast<size_t>(options_.rough_point_count));
    AlignmentOptions options;
    options.is_upright = options_.is_upright;
    options.point_weight = options_.point_weight;
    options.iteration_count_max = options_.rough_iteration_count;
    options.gate_first_m = options_.rough_far_m;
    options.gate_last_m = options_.rough_near_m;
    const auto candidate_count = static_cast<size_t>(options_.candidate_count);
    const auto shaken_count = static_cast<size_t>(options_.shaken_count);
    AlignAll(model, few, options, &starts);
    starts = KeepDistinct(starts, candidate_count, options_.starts);
    for (size_t i = std::min(starts.size(), shaken_count); i-- > 0;) Shake(starts[i], &starts);
    options.gate_first_m = options_.kept_far_m;
    options.gate_last_m = options_.kept_near_m;
    AlignAll(model, few, options, &starts);
    return KeepDistinct(starts, candidate_count, options_.starts);
  }

  // Leaves the starts ascending by cost.
  void AlignAll(const FittedModel& model, const std::vector<Eigen::Vector3d>& points,
                const AlignmentOptions& options, std::vector<Start>* starts) const {
    for (Start& start : *starts) {
      start.map_T_model = Align(model.surface, points, start.map_T_model, options);
      const Explanation explanation =
          Explain(model.surface, points, start.map_T_model, options_.inlier_m, false);
      start.cost = explanation.cost - options_.covered_weight * explanation.covered_share;
    }
    std::stable_sort(starts->begin(), starts->end(),
                     [](const Start& a, const Start& b) { return a.cost < b.cost; });
  }

  // Appends poses turned and moved a little on the floor.
  void Shake(const Start& start, std::vector<Start>* starts) const {
    const double shake_m = options_.shake_m;
    const double shake_rad = options_.shake_deg * std::numbers::pi / 180.0;
    for (const double turn : {-shake_rad, 0.0, shake_rad}) {
      for (const auto& [x, y] :
           {std::pair(0.0, 0.0), std::pair(shake_m, 0.0), std::pair(-shake_m, 0.0),
            std::pair(0.0, shake_m), std::pair(0.0, -shake_m)}) {
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
                     [this](const Candidate& a, const Candidate& b) {
                       return a.ScoreBy(options_) < b.ScoreBy(options_);
                     });
    const auto finalist_count = static_cast<size_t>(options_.finalist_count);
    if (candidates.size() > finalist_count) candidates.resize(finalist_count);
    AlignmentOptions options;
    options.is_upright = options_.is_upright;
    options.is_exact = true;
    options.point_weight = options_.point_weight;
    options.iteration_count_max = options_.exact_iteration_count;
    options.gate_first_m = options_.inlier_m;
    options.gate_last_m = options_.exact_near_m;
    for (Candidate& candidate : candidates) {
      Pose3d pose = Align(model.surface, points, candidate.map_T_model, options);
      if (floor_z_map) {
        pose.position.z() = std::clamp(pose.position.z(), *floor_z_map - options_.floor_tolerance_m,
                                       *floor_z_map + options_.floor_tolerance_m);
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
