// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/torso_graph.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>
#include <utility>
#include <variant>

#include "ingest/agents/estimation/attitude_chain.h"
#include "ingest/agents/estimation/chain_solver.h"
#include "ingest/agents/estimation/state_chain.h"
#include "ingest/agents/estimation/torso_factors.h"
#include "ingest/agents/estimation/torso_terms.h"
#include "schema/base/check.h"

namespace dsg::ingest {

/// What the graph keeps of an observation.
struct TorsoDetection {
  TimeNs time_ns = 0;
  Pose3d map_T_torso;
  Eigen::Matrix3d position_covariance_map;
  /// 0 = it gives none.
  double heading_sigma_rad = 0.0;
};

namespace {

using StandingChain = StateChain<3>;
using WalkingChain = StateChain<kSmoothStateCount>;
using HeadingChain = StateChain<1>;
using PositionChain = std::variant<StandingChain, WalkingChain>;
using RotationChain = std::variant<AttitudeChain, HeadingChain>;

// Only where Ceres gives up.
constexpr int kFallbackIterationCount = 30;
// Links of nothing would be rigid beyond double precision.
constexpr double kStepMinS = 1e-3;
// A heading that nothing tells: half a turn.
constexpr double kHeadingStart = 1.0 / (std::numbers::pi * std::numbers::pi);

double StepS(TimeNs from_ns, TimeNs to_ns) {
  const double step_s = (static_cast<double>(to_ns) - static_cast<double>(from_ns)) * 1e-9;
  return std::max(kStepMinS, step_s);
}

PositionChain MakePositionChain(const TorsoOptions& options) {
  if (options.model == TorsoModel::kPaper) return StandingChain(StandingStart());
  return WalkingChain(WalkingStart(options));
}

RotationChain MakeRotationChain(const TorsoOptions& options) {
  if (options.model == TorsoModel::kPaper) return AttitudeChain(options);
  return HeadingChain(HeadingChain::Matrix::Constant(kHeadingStart));
}

// At the end of a track. False where Ceres gives up.
bool SolveToTheEnd(HeadingChain* chain) { return SolveWithCeres(chain); }
bool SolveToTheEnd(AttitudeChain* chain) {
  chain->Solve(0, kFallbackIterationCount, false);
  return true;
}

ChainLink<3> LinkOf(const TorsoOptions& options, const StandingChain&, double step_s) {
  return StandingLink(options, step_s);
}

ChainLink<kSmoothStateCount> LinkOf(const TorsoOptions& options, const WalkingChain&,
                                    double step_s) {
  return WalkingLink(options, step_s);
}

/// The detection's orientation turned about the vertical to the heading that is believed.
Eigen::Quaterniond Turned(const Eigen::Quaterniond& map_Q_torso, double heading) {
  const double turn = heading - HeadingOf(map_Q_torso);
  const Eigen::Quaterniond about_z(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
  return (about_z * map_Q_torso).normalized();
}

}  // namespace

struct TorsoGraph::Impl {
  explicit Impl(const TorsoOptions& torso_options)
      : options(torso_options),
        position(MakePositionChain(torso_options)),
        rotation(MakeRotationChain(torso_options)) {}

  void AppendPosition(const PersonObservation& observation, double step_s, double link_step_s);
  void Relinearise(size_t first);
  void AppendRotation(const PersonObservation& observation, double link_step_s);
  void Solve(size_t first, int iteration_count, bool is_first_without_loss);
  void TakeEstimates(size_t first);
  Eigen::Quaterniond RotationAt(size_t i, Eigen::Matrix3d* covariance) const;
  PoseFactor LinkBefore(size_t i) const;

  TorsoOptions options;
  PositionChain position;
  RotationChain rotation;
  std::vector<TorsoDetection> detections;
  /// kSmooth only: the first two terms of each position.
  std::vector<RayDetection> rays;
  std::vector<TorsoEstimate> estimates;
};

void TorsoGraph::Impl::AppendPosition(const PersonObservation& observation, double step_s,
                                      double link_step_s) {
  if (auto* standing = std::get_if<StandingChain>(&position)) {
    standing->Append(StandingLink(options, link_step_s), StandingTerms(options, observation),
                     observation.map_T_torso.position);
    return;
  }
  WalkingChain::State start = WalkingChain::State::Zero();
  start.head<3>() = observation.map_T_torso.position;
  rays.emplace_back(options, observation);
  std::vector<ChainTerm<kSmoothStateCount>> terms = CueTerms(options, observation, step_s);
  const auto detected = rays.back().TermsAt(observation.map_T_torso.position);
  terms.insert(terms.begin(), detected.begin(), detected.end());
  std::get<WalkingChain>(position).Append(WalkingLink(options, link_step_s), std::move(terms),
                                          start);
}

void TorsoGraph::Impl::Relinearise(size_t first) {
  auto* walking = std::get_if<WalkingChain>(&position);
  if (walking == nullptr) return;
  for (size_t i = first; i < rays.size(); ++i) {
    const auto detected = rays[i].TermsAt(walking->state(i).head<3>());
    for (size_t j = 0; j < detected.size(); ++j) walking->ReplaceTerm(i, j, detected[j]);
  }
}

void TorsoGraph::Impl::AppendRotation(const PersonObservation& observation, double link_step_s) {
  if (auto* attitude = std::get_if<AttitudeChain>(&rotation)) {
    attitude->Append(observation, link_step_s);
    return;
  }
  const double start =
      observation.has_heading ? HeadingOf(observation.map_T_torso.orientation) : 0.0;
  std::get<HeadingChain>(rotation).Append(TurningLink(options, link_step_s),
                                          HeadingTerms(options, observation),
                                          HeadingChain::State::Constant(start));
}

void TorsoGraph::Impl::Solve(size_t first, int iteration_count, bool is_first_without_loss) {
  const auto solve = [&](auto& chain) {
    chain.Solve(first, iteration_count, is_first_without_loss);
  };
  std::visit(solve, position);
  std::visit(solve, rotation);
  TakeEstimates(first);
}

void TorsoGraph::Impl::TakeEstimates(size_t first) {
  for (size_t i = first; i < detections.size(); ++i) {
    Eigen::Matrix3d covariance;
    TorsoEstimate& estimate = estimates[i];
    std::visit(
        [&](const auto& chain) {
          estimate.map_T_torso.position = chain.state(i).template head<3>();
          covariance = chain.covariance(i).template topLeftCorner<3, 3>();
        },
        position);
    Eigen::Matrix3d turn_covariance;
    estimate.map_T_torso.orientation = RotationAt(i, &turn_covariance);
    estimate.covariance = BlockCovariance(covariance, turn_covariance);
  }
}

Eigen::Quaterniond TorsoGraph::Impl::RotationAt(size_t i, Eigen::Matrix3d* covariance) const {
  if (const auto* attitude = std::get_if<AttitudeChain>(&rotation)) {
    *covariance = attitude->covariance(i);
    return attitude->rotation(i);
  }
  const auto& heading = std::get<HeadingChain>(rotation);
  const double tilt_variance = options.tilt_sigma_rad * options.tilt_sigma_rad;
  *covariance =
      Eigen::Vector3d(tilt_variance, tilt_variance, heading.covariance(i)(0, 0)).asDiagonal();
  return Turned(detections[i].map_T_torso.orientation, heading.state(i)(0));
}

PoseFactor TorsoGraph::Impl::LinkBefore(size_t i) const {
  const TimeNs from_ns = detections[i - 1].time_ns;
  const TimeNs to_ns = detections[i].time_ns;
  if (const auto* standing = std::get_if<StandingChain>(&position)) {
    const double variance = std::get<AttitudeChain>(rotation).link_variance(i);
    return LinkFactor("zero_velocity", from_ns, to_ns, Pose3d{},
                      standing->link(i).covariance.diagonal(),
                      Eigen::Vector3d::Constant(1.0 / variance));
  }
  const auto& walking = std::get<WalkingChain>(position);
  const WalkingChain::State expected = walking.link(i).transition * walking.state(i - 1);
  const Pose3d& from = estimates[i - 1].map_T_torso;
  Pose3d step;
  step.position = from.orientation.conjugate() * (expected.head<3>() - from.position);
  // Nothing holds roll and pitch.
  const double variance = std::get<HeadingChain>(rotation).link(i).covariance(0, 0);
  return LinkFactor("motion", from_ns, to_ns, step, walking.link(i).covariance.diagonal().head<3>(),
                    {0.0, 0.0, 1.0 / variance});
}

TorsoGraph::TorsoGraph(const TorsoOptions& options) : impl_(std::make_unique<Impl>(options)) {}
TorsoGraph::TorsoGraph(TorsoGraph&&) noexcept = default;
TorsoGraph& TorsoGraph::operator=(TorsoGraph&&) noexcept = default;
TorsoGraph::~TorsoGraph() = default;

bool TorsoGraph::Add(const PersonObservation& observation) {
  Impl& impl = *impl_;
  const bool is_first = impl.detections.empty();
  if (!IsUsable(observation)) return false;
  if (!is_first && observation.time_ns <= impl.detections.back().time_ns) return false;
  const double link_step_s =
      is_first ? 1.0 : StepS(impl.detections.back().time_ns, observation.time_ns);
  const double step_s = is_first ? std::numeric_limits<double>::infinity() : link_step_s;
  impl.AppendPosition(observation, step_s, link_step_s);
  impl.AppendRotation(observation, link_step_s);
  impl.detections.push_back({observation.time_ns, observation.map_T_torso,
                             observation.position_covariance_map,
                             observation.has_heading ? observation.heading_sigma_rad : 0.0});
  impl.estimates.push_back({});
  impl.estimates.back().time_ns = observation.time_ns;
  // A first belief, so that estimates and predictions are sound before the next solve.
  impl.Solve(impl.detections.size() - 1, 1, false);
  return true;
}

size_t TorsoGraph::SolveRecent() {
  const size_t count = impl_->detections.size();
  if (count == 0) return 0;
  const size_t lag = static_cast<size_t>(std::max(1, impl_->options.lag_count));
  const size_t first = count > lag ? count - lag : 0;
  impl_->Relinearise(first);
  const TorsoOptions& options = impl_->options;
  const bool is_young = first == 0 && count <= static_cast<size_t>(options.young_count);
  impl_->Solve(first, is_young ? options.young_iteration_count : options.live_iteration_count,
               is_young);
  return first;
}

void TorsoGraph::SolveAll() {
  if (impl_->detections.empty()) return;
  impl_->Relinearise(0);
  const bool is_solved =
      std::visit([](auto& chain) { return SolveWithCeres(&chain); }, impl_->position) &&
      std::visit([](auto& chain) { return SolveToTheEnd(&chain); }, impl_->rotation);
  impl_->Solve(0, is_solved ? 1 : kFallbackIterationCount, false);
}

void TorsoGraph::Freeze() {
  impl_->position = MakePositionChain(impl_->options);
  impl_->rotation = MakeRotationChain(impl_->options);
  std::vector<RayDetection>().swap(impl_->rays);
  std::vector<TorsoDetection>().swap(impl_->detections);
}

const std::vector<TorsoEstimate>& TorsoGraph::estimates() const { return impl_->estimates; }

std::vector<TorsoEstimate> TorsoGraph::ExchangeEstimates(std::vector<TorsoEstimate> estimates) {
  return std::exchange(impl_->estimates, std::move(estimates));
}

TorsoPrediction TorsoGraph::Predict(TimeNs time_ns) const {
  DSG_CHECK(!impl_->detections.empty());
  const double step_s = StepS(impl_->detections.back().time_ns, time_ns);
  TorsoPrediction prediction;
  std::visit(
      [&](const auto& chain) {
        const size_t last = chain.size() - 1;
        const auto link = LinkOf(impl_->options, chain, step_s);
        const auto state = (link.transition * chain.state(last)).eval();
        const auto covariance =
            (link.transition * chain.covariance(last) * link.transition.transpose() +
             link.covariance)
                .eval();
        prediction.position_map = state.template head<3>();
        prediction.covariance_map = covariance.template topLeftCorner<3, 3>();
        if constexpr (std::is_same_v<std::decay_t<decltype(chain)>, WalkingChain>) {
          prediction.velocity_map = state.template segment<3>(3);
        }
      },
      impl_->position);
  return prediction;
}

std::vector<PoseFactor> TorsoGraph::Factors(size_t first) const {
  std::vector<PoseFactor> factors;
  for (size_t i = first; i < impl_->detections.size(); ++i) {
    const TorsoDetection& detection = impl_->detections[i];
    if (i > 0) factors.push_back(impl_->LinkBefore(i));
    factors.push_back(DetectionFactor(detection.time_ns, detection.map_T_torso,
                                      detection.position_covariance_map,
                                      detection.heading_sigma_rad, impl_->options.tilt_sigma_rad));
  }
  return factors;
}

}  // namespace dsg::ingest
