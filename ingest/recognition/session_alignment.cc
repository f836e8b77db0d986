// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/session_alignment.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "absl/strings/str_format.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180.0;

constexpr OptionField<SessionAlignmentOptions> kAlignmentFields[] = {
    {"align-agree", &SessionAlignmentOptions::agree_m, 0.01, 100.0,
     "Views of places that both sessions saw agree on the transform between them within this, "
     "metres: what two paths drift by within a building"},
    {"align-agree-turn", &SessionAlignmentOptions::agree_deg, 0.1, 90.0,
     "... and within this turn, degrees"},
    {"align-count", &SessionAlignmentOptions::agree_count_min, 2, 1000,
     "Views at least that must agree: two wrong ones agree by chance now and then"},
    {"align-places", &SessionAlignmentOptions::place_count_min, 1, 1000,
     "... from so many places: rooms of one kind look alike, and one of them is no proof"},
    {"align-place-gap", &SessionAlignmentOptions::place_gap_m, 0.0, 100.0,
     "Places are this far apart, metres: a few steps"},
    {"align-share", &SessionAlignmentOptions::agree_share_min, 0.0, 1.0,
     "Share of all views that must agree: two transforms cannot have more than half each"},
    {"align-sigma", &SessionAlignmentOptions::position_sigma_m, 0.001, 10.0,
     "Standard deviation of what one view tells of the shift, metres: that of a loop closure, and "
     "of both paths near it"},
    {"align-sigma-turn", &SessionAlignmentOptions::turn_sigma_deg, 0.01, 45.0,
     "... and of the turn, degrees"},
};

/// Where a tie's body is in both maps, and the turn between them about the vertical.
struct Sighting {
  Vector3d at_map;
  Vector3d at_other;
  double turn_rad = 0.0;
};

struct Upright {
  double turn_rad = 0.0;
  Vector3d shift = Vector3d::Zero();
};

double Wrapped(double angle_rad) { return std::remainder(angle_rad, 2.0 * M_PI); }

Eigen::AngleAxisd AboutVertical(double turn_rad) { return {turn_rad, Vector3d::UnitZ()}; }

Sighting SeenInBoth(const SessionTie& tie) {
  const Pose3d map_T_other_body = tie.map_T_body * tie.body_T_other_body;
  const Eigen::Matrix3d turn =
      (map_T_other_body.orientation * tie.other_T_body.orientation.conjugate()).toRotationMatrix();
  return {map_T_other_body.position, tie.other_T_body.position,
          std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1))};
}

Vector3d MissOf(const Sighting& sighting, const Upright& map_T_other) {
  return AboutVertical(map_T_other.turn_rad) * sighting.at_other + map_T_other.shift -
         sighting.at_map;
}

std::vector<Sighting> AgreeingWith(const Upright& map_T_other,
                                   const std::vector<Sighting>& sightings,
                                   const SessionAlignmentOptions& options) {
  std::vector<Sighting> agreeing;
  std::copy_if(sightings.begin(), sightings.end(), std::back_inserter(agreeing),
               [&](const Sighting& sighting) {
                 return MissOf(sighting, map_T_other).norm() <= options.agree_m &&
                        std::abs(Wrapped(sighting.turn_rad - map_T_other.turn_rad)) <=
                            options.agree_deg * kDegree;
               });
  return agreeing;
}

/// How many of them are further apart than the gap from all that were counted before.
int PlaceCountOf(const std::vector<Sighting>& sightings, double gap_m) {
  std::vector<Vector3d> places;
  for (const Sighting& sighting : sightings) {
    const bool is_new = std::all_of(places.begin(), places.end(), [&](const Vector3d& place) {
      return (place - sighting.at_other).norm() >= gap_m;
    });
    if (is_new) places.push_back(sighting.at_other);
  }
  return static_cast<int>(places.size());
}

Vector3d MiddleOf(const std::vector<Sighting>& sightings, Vector3d Sighting::*at) {
  Vector3d sum = Vector3d::Zero();
  for (const Sighting& sighting : sightings) sum += sighting.*at;
  return sum / static_cast<double>(sightings.size());
}

/// Least squares of positions and turns. About the middle of the ties the shift does not depend on
/// the turn, which is a sum of the turns of the ties and of how their places lie to each other.
SessionAlignment Fitted(const std::vector<Sighting>& agreeing, double turn_rad,
                        const SessionAlignmentOptions& options) {
  const Vector3d map_middle = MiddleOf(agreeing, &Sighting::at_map);
  const Vector3d other_middle = MiddleOf(agreeing, &Sighting::at_other);
  const double turn_weight = 1.0 / std::pow(options.turn_sigma_deg * kDegree, 2);
  const double position_weight = 1.0 / std::pow(options.position_sigma_m, 2);
  double information = 0.0;
  for (int step = 0; step < 5; ++step) {
    information = 0.0;
    double pull = 0.0;
    for (const Sighting& sighting : agreeing) {
      const Vector3d arm = AboutVertical(turn_rad) * (sighting.at_other - other_middle);
      const Vector3d along = Vector3d::UnitZ().cross(arm);
      const Vector3d miss = sighting.at_map - map_middle - arm;
      information += turn_weight + position_weight * along.squaredNorm();
      pull +=
          turn_weight * Wrapped(sighting.turn_rad - turn_rad) + position_weight * along.dot(miss);
    }
    turn_rad = Wrapped(turn_rad + pull / information);
  }
  SessionAlignment fit;
  fit.map_T_other.orientation = Eigen::Quaterniond(AboutVertical(turn_rad));
  fit.map_T_other.position = map_middle - fit.map_T_other.orientation * other_middle;
  fit.turn_sigma_rad = 1.0 / std::sqrt(information);
  fit.position_sigma_m = options.position_sigma_m / std::sqrt(static_cast<double>(agreeing.size()));
  double sum = 0.0;
  for (const Sighting& sighting : agreeing) {
    sum += (fit.map_T_other * sighting.at_other - sighting.at_map).squaredNorm();
  }
  fit.residual_m = std::sqrt(sum / static_cast<double>(agreeing.size()));
  fit.agree_count = static_cast<int>(agreeing.size());
  return fit;
}

}  // namespace

std::vector<BoundOption> SessionAlignmentOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<SessionAlignmentOptions>(kAlignmentFields, this, &bound);
  return bound;
}

absl::StatusOr<SessionAlignment> AlignSessions(std::span<const SessionTie> ties,
                                               const SessionAlignmentOptions& options) {
  std::vector<Sighting> sightings;
  for (const SessionTie& tie : ties) sightings.push_back(SeenInBoth(tie));
  std::vector<Sighting> most;
  double turn_rad = 0.0;
  for (const Sighting& sighting : sightings) {
    const Upright guess{sighting.turn_rad,
                        sighting.at_map - AboutVertical(sighting.turn_rad) * sighting.at_other};
    std::vector<Sighting> agreeing = AgreeingWith(guess, sightings, options);
    if (agreeing.size() <= most.size()) continue;
    most = std::move(agreeing);
    turn_rad = sighting.turn_rad;
  }
  const double share =
      static_cast<double>(most.size()) / static_cast<double>(std::max<size_t>(1, ties.size()));
  const int place_count = PlaceCountOf(most, options.place_gap_m);
  if (std::ssize(most) < options.agree_count_min || share < options.agree_share_min ||
      place_count < options.place_count_min) {
    return MakeError(
        Reason::kNoRegistration,
        absl::StrFormat("%d views show places that both sessions saw, and %d of these agree, from "
                        "%d places %g m apart; needed are %d (--align-count), %g %% of all "
                        "(--align-share), and %d places (--align-places, --align-place-gap)",
                        ties.size(), most.size(), place_count, options.place_gap_m,
                        options.agree_count_min, 100.0 * options.agree_share_min,
                        options.place_count_min));
  }
  SessionAlignment fit = Fitted(most, turn_rad, options);
  fit.tie_count = static_cast<int>(std::ssize(ties));
  return fit;
}

}  // namespace dsg::ingest
