// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/gravity.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dsg::ingest {
namespace {

constexpr double kDegree = M_PI / 180.0;
// Of directions that are tried: no option, for least squares follow.
constexpr double kSearchStep = 3.0 * kDegree;

constexpr OptionField<GravityOptions> kGravityFields[] = {
    {"up-normals", &GravityOptions::normal_count_max, 100, 1'000'000,
     "Normals of surfaces that are looked at in all pictures together: time"},
    {"up-normals-picture", &GravityOptions::frame_normal_count_max, 10, 1'000'000,
     "... and in one, so that none decides alone"},
    {"up-normals-min", &GravityOptions::normal_count_min, 1, 1'000'000,
     "With fewer up is not told: too little was flat"},
    {"up-together", &GravityOptions::mean_up_min, 0.0, 1.0,
     "Least mean of the pictures' own ups, unit vectors: a camera that was held in all ways has "
     "none"},
    {"up-tilt", &GravityOptions::tilt_rad_max, 0.05, M_PI,
     "How far up may be from their mean, radians: 75 degrees, cameras look down at tables"},
    {"up-roll", &GravityOptions::roll_sigma_rad, 0.01, 3.2,
     "How far a camera in the hand is turned about its axis, one standard deviation, radians: 12 "
     "degrees"},
    {"up-search-width", &GravityOptions::search_width_rad, 0.01, 0.7,
     "Surfaces this near to level or upright count while up is searched for, radians: 8 degrees, "
     "two steps of the search and more"},
    {"up-refine-width", &GravityOptions::refine_width_rad, 0.01, 0.7,
     "... and while it is refined, radians: 5 degrees, noise of normals"},
    {"up-level-share", &GravityOptions::level_share_min, 0.0, 1.0,
     "Least share of surfaces that are level, or up is doubtful: without a floor it is a guess"},
    {"up-explained-share", &GravityOptions::explained_share_min, 0.0, 1.0,
     "... and that are level or upright: rooms are, heaps are not"},
    {"up-other", &GravityOptions::other_rad, 0.01, 3.2,
     "Up is doubtful if a direction this far off does as well, radians: 20 degrees"},
    {"up-other-score", &GravityOptions::other_score_max, 0.0, 1.0,
     "... or nearly as well, share of its score: noise of scores"},
};

struct Evidence {
  std::vector<Eigen::Vector3d> normals;
  /// Up and right of each image.
  std::vector<Eigen::Vector3d> ups;
  std::vector<Eigen::Vector3d> rights;
};

Evidence Gather(const std::vector<DepthFrame>& frames, const GravityOptions& options) {
  Evidence evidence;
  const int per_frame =
      std::min(options.frame_normal_count_max,
               options.normal_count_max / std::max(1, static_cast<int>(frames.size())) + 1);
  for (const DepthFrame& frame : frames) {
    const Eigen::Matrix3d map_R = frame.map_T_camera.orientation.toRotationMatrix();
    evidence.ups.emplace_back(-map_R.col(1));
    evidence.rights.emplace_back(map_R.col(0));
    const std::vector<Eigen::Vector3d> normals = SurfaceNormals(frame, per_frame, options.normals);
    evidence.normals.insert(evidence.normals.end(), normals.begin(), normals.end());
  }
  return evidence;
}

// 1 for a sine of 0, falling to 0 at the sine of `width`. Takes the sine's square.
double Near(double sine_squared, double width) {
  const double limit = std::sin(width) * std::sin(width);
  return sine_squared < limit ? 1.0 - sine_squared / limit : 0.0;
}

double SquaredCosine(const Eigen::Vector3d& up, const Eigen::Vector3d& normal) {
  const double cosine = up.dot(normal);
  return std::min(1.0, cosine * cosine);
}

struct Score {
  /// Shares of all normals.
  double level = 0.0;
  double upright = 0.0;
  /// How likely the images' rows are so tilted.
  double roll = 0.0;

  // A level surface tells two angles and chance hits one of 200; an upright one tells one angle
  // and chance hits one of 10. The root keeps a bare wall from outvoting the floor beside it. The
  // form of the score is no option.
  double Total() const { return std::sqrt(level) * (0.2 + level + upright) * roll; }
};

Score ScoreOf(const Evidence& evidence, const GravityOptions& options, const Eigen::Vector3d& up) {
  Score score;
  for (const Eigen::Vector3d& normal : evidence.normals) {
    const double squared = SquaredCosine(up, normal);
    score.level += Near(1.0 - squared, options.search_width_rad);
    score.upright += Near(squared, options.search_width_rad);
  }
  score.level /= static_cast<double>(evidence.normals.size());
  score.upright /= static_cast<double>(evidence.normals.size());
  double squares = 0.0;
  for (const Eigen::Vector3d& right : evidence.rights) squares += std::pow(up.dot(right), 2);
  squares /= static_cast<double>(evidence.rights.size());
  score.roll = std::exp(-0.5 * squares / (options.roll_sigma_rad * options.roll_sigma_rad));
  return score;
}

struct Candidate {
  Eigen::Vector3d up;
  Score score;
};

// Directions on circles around `middle`, about a step apart.
std::vector<Candidate> Search(const Evidence& evidence, const GravityOptions& options,
                              const Eigen::Vector3d& middle) {
  const Eigen::Vector3d x = middle.unitOrthogonal();
  const Eigen::Vector3d y = middle.cross(x);
  std::vector<Candidate> candidates;
  for (double tilt = 0.0; tilt <= options.tilt_rad_max; tilt += kSearchStep) {
    const int count = std::max(1, static_cast<int>(2.0 * M_PI * std::sin(tilt) / kSearchStep));
    for (int i = 0; i < count; ++i) {
      const double turn = 2.0 * M_PI * i / count;
      const Eigen::Vector3d up =
          std::cos(tilt) * middle + std::sin(tilt) * (std::cos(turn) * x + std::sin(turn) * y);
      candidates.push_back({up, ScoreOf(evidence, options, up)});
    }
  }
  return candidates;
}

// Least squares: level normals along up, upright ones across.
Eigen::Vector3d Refine(const Evidence& evidence, double last_width, Eigen::Vector3d up) {
  for (const double width : {2.0 * last_width, last_width, last_width, last_width}) {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& normal : evidence.normals) {
      const double squared = SquaredCosine(up, normal);
      const double weight = Near(1.0 - squared, width) - Near(squared, width);
      squares += weight * normal * normal.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares);
    const Eigen::Vector3d axis = solver.eigenvectors().col(2);
    up = axis.dot(up) < 0.0 ? Eigen::Vector3d(-axis) : axis;
  }
  return up;
}

}  // namespace

std::vector<BoundOption> GravityOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<GravityOptions>(kGravityFields, this, &bound);
  const std::vector<BoundOption> normals_bound = normals.Bind();
  bound.insert(bound.end(), normals_bound.begin(), normals_bound.end());
  return bound;
}

std::optional<Eigen::Vector3d> EstimateUp(const std::vector<DepthFrame>& frames,
                                          const GravityOptions& options) {
  const Evidence evidence = Gather(frames, options);
  if (std::ssize(evidence.normals) < options.normal_count_min) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& up : evidence.ups) middle += up;
  if (middle.norm() < options.mean_up_min * static_cast<double>(frames.size())) return std::nullopt;
  const std::vector<Candidate> candidates = Search(evidence, options, middle.normalized());
  const auto best = std::max_element(
      candidates.begin(), candidates.end(),
      [](const Candidate& a, const Candidate& b) { return a.score.Total() < b.score.Total(); });
  const Eigen::Vector3d up = Refine(evidence, options.refine_width_rad, best->up);
  const Score score = ScoreOf(evidence, options, up);
  if (score.level < options.level_share_min ||
      score.level + score.upright < options.explained_share_min) {
    return std::nullopt;
  }
  for (const Candidate& other : candidates) {
    const bool is_other = std::acos(std::clamp(other.up.dot(up), -1.0, 1.0)) > options.other_rad;
    if (is_other && other.score.Total() > options.other_score_max * score.Total())
      return std::nullopt;
  }
  return up;
}

}  // namespace dsg::ingest
