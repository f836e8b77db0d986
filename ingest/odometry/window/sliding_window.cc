// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/sliding_window.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/inertial/inertial_factor.h"
#include "ingest/odometry/inertial/marginalization.h"
#include "ingest/odometry/window/factor_covariance.h"
#include "ingest/solver/pose_block.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

absl::Status BadKeyframe(TimeNs time_ns, const std::string& what) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("the keyframe at ", time_ns, " ns ", what, "; begin anew"),
                   {{"field", "time_ns"}, {"value", absl::StrCat(time_ns)}});
}

}  // namespace

class SlidingWindow::Impl {
 public:
  Impl(const StereoModel& model, const Vector3d& gravity_map, const WindowOptions& options)
      : model_(model),
        gravity_map_(gravity_map),
        options_(options),
        manifold_(MakePoseManifold()),
        loss_(options.huber_sigmas),
        slots_(static_cast<size_t>(options.keyframe_count) + 1),
        landmarks_(model, options) {}

  absl::Status Begin(TimeNs time_ns, const AlignedState& aligned,
                     std::span<const FeatureSight> sights) {
    const Eigen::LLT<Matrix15d> root(aligned.covariance);
    if (!aligned.covariance.allFinite() || root.info() != Eigen::Success) {
      return BadKeyframe(time_ns, "has no covariance that is positive definite");
    }
    BeginKeyframes(time_ns, aligned.state, /*has_unit=*/true);
    SetFirstPrior(root.matrixL().solve(Matrix15d::Identity()));
    SeeLandmarks(sights);
    told_landmarks_ = landmarks_.Told(Poses());
    return absl::OkStatus();
  }

  absl::Status BeginByImages(TimeNs time_ns, const Pose3d& map_T_imu, const Matrix6d& covariance,
                             std::span<const FeatureSight> sights) {
    const Eigen::LLT<Matrix6d> root(covariance);
    if (!covariance.allFinite() || root.info() != Eigen::Success) {
      return BadKeyframe(time_ns, "has no covariance that is positive definite");
    }
    BeginKeyframes(time_ns, {.map_T_imu = map_T_imu}, /*has_unit=*/false);
    SetFirstPrior(root.matrixL().solve(Matrix6d::Identity()));
    SeeLandmarks(sights);
    told_landmarks_ = landmarks_.Told(Poses());
    return absl::OkStatus();
  }

  absl::Status Add(TimeNs time_ns, Preintegration measured, std::span<const FeatureSight> sights) {
    dropped_.clear();
    if (keyframes_.empty() || !has_unit_) return BadKeyframe(time_ns, "is in no window of a unit");
    if (measured.from_ns() != newest_ns() || measured.to_ns() != time_ns) {
      return BadKeyframe(time_ns, absl::StrCat("has samples from ", measured.from_ns(), " to ",
                                               measured.to_ns(), " ns"));
    }
    const InertialState predicted = measured.Predict(newest(), gravity_map_, nullptr);
    AddKeyframe(time_ns, predicted, std::make_unique<Preintegration>(std::move(measured)));
    return Estimate(sights);
  }

  absl::Status AddByImages(TimeNs time_ns, const Pose3d& guess,
                           std::span<const FeatureSight> sights) {
    dropped_.clear();
    const bool is_next = !keyframes_.empty() && !has_unit_ && time_ns > newest_ns();
    if (!is_next) return BadKeyframe(time_ns, "is in no window without a unit, or not the next");
    AddKeyframe(time_ns, {.map_T_imu = guess}, nullptr);
    return Estimate(sights);
  }

  int keyframe_count() const { return static_cast<int>(keyframes_.size()); }
  TimeNs newest_ns() const { return keyframes_.back().time_ns; }
  InertialState newest() const { return StateOf(keyframes_.back()); }

  absl::StatusOr<Matrix15d> NewestCovariance() const {
    StateSlot& slot = SlotOf(keyframes_.back().number);
    double* const wanted[] = {slot.pose.data(), slot.speed.data()};
    DSG_ASSIGN_OR_RETURN(const Eigen::MatrixXd covariance, CovarianceOfNewest(wanted));
    return Matrix15d(covariance);
  }

  absl::StatusOr<Matrix6d> NewestPoseCovariance() const {
    double* const wanted[] = {SlotOf(keyframes_.back().number).pose.data()};
    DSG_ASSIGN_OR_RETURN(const Eigen::MatrixXd covariance, CovarianceOfNewest(wanted));
    return Matrix6d(covariance);
  }

  std::optional<Vector3d> PointOf(int64_t feature_id) const {
    if (keyframes_.empty()) return std::nullopt;
    return landmarks_.PointOf(feature_id, Poses());
  }

  double misfit() const { return misfit_; }
  CalibrationError& calibration_error() const { return slots_.front().calibration_error; }
  const std::vector<int64_t>& dropped() const { return dropped_; }
  const std::vector<SeenLandmark>& landmarks() const { return told_landmarks_; }

 private:
  struct StateSlot {
    std::array<double, kPoseBlockSize> pose{};
    std::array<double, kSpeedBlockSize> speed{};
    /// Of the first slot only, for all: Ceres sorts blocks by their addresses, and beside the
    /// states it has the same place among them in every run.
    CalibrationError calibration_error{};
  };

  struct Keyframe {
    /// Ascending; never used again.
    int64_t number = 0;
    TimeNs time_ns = 0;
    /// As the gyroscope measured it, bias and all.
    Vector3d rate_rad_s = Vector3d::Zero();
    /// From the keyframe before; null of the first one, and of all without a unit.
    std::unique_ptr<Preintegration> measured;
  };

  // The window's factors at one moment; the blocks are those of the window.
  struct FactorList {
    std::vector<std::unique_ptr<ceres::CostFunction>> owned;
    std::vector<WindowFactor> factors;
    /// Blocks of the landmarks that tell something, in their order.
    std::vector<double*> landmarks;

    void Add(std::unique_ptr<ceres::CostFunction> cost, const ceres::LossFunction* loss,
             std::vector<double*> blocks) {
      factors.push_back({cost.get(), loss, std::move(blocks)});
      owned.push_back(std::move(cost));
    }
  };

  // Before a solve, states are predictions: only what is far off is no landmark.
  static constexpr double kFarMisses = 10.0;

  InertialState StateOf(const Keyframe& keyframe) const {
    const StateSlot& slot = SlotOf(keyframe.number);
    return StateOfBlocks(slot.pose.data(), slot.speed.data());
  }
  // Slots go by turn: where the blocks are in memory, by which Ceres sorts them, follows from the
  // calls alone.
  StateSlot& SlotOf(int64_t number) const {
    return slots_[static_cast<size_t>(number) % slots_.size()];
  }
  WindowPoses Poses() const {
    WindowPoses poses{keyframes_.front().number, {}, {}, calibration_error()};
    for (const Keyframe& keyframe : keyframes_) {
      poses.map_T_imu.push_back(PoseOfBlock(SlotOf(keyframe.number).pose.data()));
      poses.motions.push_back(MotionOf(keyframe));
    }
    return poses;
  }
  CameraMotion MotionOf(const Keyframe& keyframe) const {
    if (!has_unit_) return {};
    const InertialState state = StateOf(keyframe);
    const Quaterniond camera_R_imu = model_.imu_T_camera.orientation.conjugate();
    const Vector3d turn_rad_s = keyframe.rate_rad_s - state.bias.gyro_rad_s;
    const Vector3d speed_m_s = state.map_T_imu.orientation.conjugate() * state.velocity_map +
                               turn_rad_s.cross(model_.imu_T_camera.position);
    return {camera_R_imu * turn_rad_s, camera_R_imu * speed_m_s};
  }

  // Forgets all, what was learnt of the calibration, too: it may have been why one got lost.
  void BeginKeyframes(TimeNs time_ns, const InertialState& state, bool has_unit) {
    keyframes_.clear();
    landmarks_.Clear();
    dropped_.clear();
    misfit_ = 0.0;
    has_unit_ = has_unit;
    calibration_error() = {};
    AddKeyframe(time_ns, state, nullptr);
  }

  // Of the first state, by the root of its information, and of the calibration.
  void SetFirstPrior(const Eigen::MatrixXd& root) {
    StateSlot& slot = SlotOf(keyframes_.back().number);
    const auto size = root.rows();
    LinearPrior prior;
    const auto add = [&](std::span<double> block) {
      prior.blocks.push_back(block.data());
      prior.sizes.push_back(static_cast<int>(block.size()));
      prior.point.insert(prior.point.end(), block.begin(), block.end());
    };
    add(slot.pose);
    if (has_unit_) add(slot.speed);
    add(calibration_error());
    prior.jacobian =
        Eigen::MatrixXd::Zero(size + kCalibrationErrorSize, size + kCalibrationErrorSize);
    prior.jacobian.topLeftCorner(size, size) = root;
    prior.jacobian(size, size) = 1.0 / options_.disparity_offset_px;
    prior.jacobian(size + 1, size + 1) = 1.0 / options_.baseline_share;
    prior.jacobian(size + 2, size + 2) = 1.0 / options_.clock_s;
    prior.residual = Eigen::VectorXd::Zero(size + kCalibrationErrorSize);
    SetPrior(std::move(prior));
  }

  // With the newest keyframe, which has come without its sights.
  absl::Status Estimate(std::span<const FeatureSight> sights) {
    SeeLandmarks(sights);
    DropMisfits(kFarMisses);
    DSG_RETURN_IF_ERROR(Solve());
    DSG_RETURN_IF_ERROR(Reintegrate());
    DropMisfits(1.0);
    told_landmarks_ = landmarks_.Told(Poses());
    if (keyframes_.size() > static_cast<size_t>(options_.keyframe_count)) {
      DSG_RETURN_IF_ERROR(DropOldest());
    }
    landmarks_.ForgetLost(keyframes_.back().number);
    return absl::OkStatus();
  }

  // Those that the newest keyframe sees, by the poses of now.
  void SeeLandmarks(std::span<const FeatureSight> sights) {
    landmarks_.AddSights(keyframes_.back().number, sights);
    landmarks_.Anchor(Poses());
  }

  // Landmarks that miss by more than `times` the limit are dropped.
  void DropMisfits(double times) {
    std::vector<int64_t> dropped = landmarks_.DropMisfits(times * options_.miss_px_max, Poses());
    dropped_.insert(dropped_.end(), dropped.begin(), dropped.end());
    std::sort(dropped_.begin(), dropped_.end());
  }

  void AddKeyframe(TimeNs time_ns, const InertialState& state,
                   std::unique_ptr<Preintegration> measured) {
    const int64_t number = next_number_++;
    WritePoseBlock(state.map_T_imu, SlotOf(number).pose.data());
    WriteSpeedBlock(state, SlotOf(number).speed.data());
    keyframes_.push_back({number, time_ns, Vector3d::Zero(), std::move(measured)});
    if (keyframes_.back().measured == nullptr) return;
    const std::span<const ImuMeasurement> samples = keyframes_.back().measured->samples();
    keyframes_.back().rate_rad_s = samples.back().angular_velocity_rad_s;
    // Of the first keyframe no samples before it are known.
    if (keyframes_.size() == 2) {
      keyframes_.front().rate_rad_s = samples.front().angular_velocity_rad_s;
    }
  }

  void SetPrior(LinearPrior prior) {
    prior_blocks_ = prior.blocks;
    prior_ = prior.residual.size() > 0 ? MakePriorFactor(std::move(prior)) : nullptr;
  }

  // `blocks` holds the landmarks that tell something, in their order: memory is ordered as they
  // are, by which Ceres sorts.
  FactorList Factors(std::vector<LandmarkBlock>* blocks) const {
    blocks->clear();
    for (const auto& [id, landmark] : landmarks_.all()) {
      if (landmark.tells()) blocks->push_back(landmark.block);
    }
    FactorList list;
    if (prior_ != nullptr) list.factors.push_back({prior_.get(), nullptr, prior_blocks_});
    for (size_t i = 1; i < keyframes_.size() && has_unit_; ++i) AddInertial(i, &list);
    const WindowPoses poses = Poses();
    size_t index = 0;
    for (const auto& [id, landmark] : landmarks_.all()) {
      if (landmark.tells()) AddSightsOf(landmark, poses, (*blocks)[index++].data(), &list);
    }
    return list;
  }

  absl::StatusOr<Eigen::MatrixXd> CovarianceOfNewest(std::span<double* const> wanted) const {
    std::vector<LandmarkBlock> blocks;
    const FactorList list = Factors(&blocks);
    return CovarianceOf(list.factors, list.landmarks, wanted);
  }

  void AddInertial(size_t i, FactorList* list) const {
    StateSlot& from = SlotOf(keyframes_[i - 1].number);
    StateSlot& to = SlotOf(keyframes_[i].number);
    list->Add(MakeInertialFactor(keyframes_[i].measured.get(), gravity_map_), nullptr,
              {from.pose.data(), from.speed.data(), to.pose.data(), to.speed.data()});
  }

  void AddSightsOf(const WindowLandmark& landmark, const WindowPoses& poses, double* block,
                   FactorList* list) const {
    const SightNoise noise{options_.pixel_sigma_px, options_.disparity_sigma_px};
    double* const error = calibration_error().data();
    double* const anchor_pose = SlotOf(landmark.anchor_keyframe()).pose.data();
    list->landmarks.push_back(block);
    for (size_t i = 0; i < landmark.sights.size(); ++i) {
      const WindowLandmark::Sight& sight = landmark.sights[i];
      const CameraMotion& motion = poses.MotionOf(sight.keyframe);
      if (i == *landmark.anchor) {
        list->Add(MakeAnchorFactor(model_, sight.seen, noise, motion), &loss_, {block, error});
      } else {
        list->Add(MakeSightFactor(model_, sight.seen, noise, motion), &loss_,
                  {anchor_pose, SlotOf(sight.keyframe).pose.data(), block, error});
      }
    }
  }

  absl::Status Solve() {
    std::vector<LandmarkBlock> blocks;
    const FactorList list = Factors(&blocks);
    ceres::Problem::Options problem_options;
    problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(problem_options);
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (const Keyframe& keyframe : keyframes_) {
      StateSlot& slot = SlotOf(keyframe.number);
      problem.AddParameterBlock(slot.pose.data(), kPoseBlockSize, manifold_.get());
      ordering->AddElementToGroup(slot.pose.data(), 1);
      if (!has_unit_) continue;
      problem.AddParameterBlock(slot.speed.data(), kSpeedBlockSize);
      ordering->AddElementToGroup(slot.speed.data(), 1);
    }
    problem.AddParameterBlock(calibration_error().data(), kCalibrationErrorSize);
    ordering->AddElementToGroup(calibration_error().data(), 1);
    for (double* landmark : list.landmarks) {
      problem.AddParameterBlock(landmark, kLandmarkBlockSize);
      ordering->AddElementToGroup(landmark, 0);
    }
    for (const WindowFactor& factor : list.factors) {
      problem.AddResidualBlock(const_cast<ceres::CostFunction*>(factor.cost),
                               const_cast<ceres::LossFunction*>(factor.loss), factor.blocks);
    }
    ceres::Solver::Options options;
    options.linear_solver_type =
        list.landmarks.empty() ? ceres::DENSE_NORMAL_CHOLESKY : ceres::DENSE_SCHUR;
    options.linear_solver_ordering = ordering;
    options.max_num_iterations = options_.step_count;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) {
      return BadKeyframe(newest_ns(), absl::StrCat("has no solution: ", summary.message));
    }
    size_t index = 0;
    for (auto& [id, landmark] : landmarks_.all()) {
      if (landmark.tells()) landmark.block = blocks[index++];
    }
    const int spare_count = summary.num_residuals - summary.num_effective_parameters;
    misfit_ = 2.0 * summary.final_cost / std::max(1, spare_count);
    return absl::OkStatus();
  }

  absl::Status Reintegrate() {
    for (size_t i = 1; i < keyframes_.size() && has_unit_; ++i) {
      const ImuBias bias = StateOf(keyframes_[i - 1]).bias;
      if (!keyframes_[i].measured->IsFarFrom(bias)) continue;
      DSG_RETURN_IF_ERROR(keyframes_[i].measured->Reintegrate(bias));
    }
    return absl::OkStatus();
  }

  // What the oldest keyframe and the landmarks that it saw first tell of the others becomes the
  // prior. Landmarks that others saw first lose their sights in it.
  absl::Status DropOldest() {
    const Keyframe& oldest = keyframes_.front();
    landmarks_.DropSightsOf(oldest.number);
    std::vector<LandmarkBlock> blocks;
    blocks.reserve(landmarks_.all().size());
    FactorList list;
    if (prior_ != nullptr) list.factors.push_back({prior_.get(), nullptr, prior_blocks_});
    if (has_unit_) AddInertial(1, &list);
    const WindowPoses poses = Poses();
    for (const auto& [id, landmark] : landmarks_.all()) {
      if (!landmark.tells() || landmark.anchor_keyframe() != oldest.number) continue;
      blocks.push_back(landmark.block);
      AddSightsOf(landmark, poses, blocks.back().data(), &list);
    }
    std::vector<double*> dropped = list.landmarks;
    StateSlot& slot = SlotOf(oldest.number);
    dropped.push_back(slot.pose.data());
    if (has_unit_) dropped.push_back(slot.speed.data());
    DSG_ASSIGN_OR_RETURN(LinearPrior prior, Marginalize(list.factors, dropped, {}));
    SetPrior(std::move(prior));
    landmarks_.ForgetAnchoredIn(oldest.number);
    keyframes_.pop_front();
    keyframes_.front().measured = nullptr;
    return absl::OkStatus();
  }

  const StereoModel model_;
  const Vector3d gravity_map_;
  const WindowOptions options_;
  const std::unique_ptr<ceres::Manifold> manifold_;
  mutable ceres::HuberLoss loss_;
  // Parameter blocks: the factors of a window that does not change name them, too.
  mutable std::vector<StateSlot> slots_;
  std::deque<Keyframe> keyframes_;
  WindowLandmarks landmarks_;
  std::unique_ptr<ceres::CostFunction> prior_;
  std::vector<double*> prior_blocks_;
  std::vector<int64_t> dropped_;
  std::vector<SeenLandmark> told_landmarks_;
  double misfit_ = 0.0;
  int64_t next_number_ = 0;
  // Whether states have velocities and biases, and an inertial unit between them.
  bool has_unit_ = true;
};

SlidingWindow::SlidingWindow(const StereoModel& model, const Vector3d& gravity_map,
                             const WindowOptions& options)
    : impl_(std::make_unique<Impl>(model, gravity_map, options)) {}
SlidingWindow::~SlidingWindow() = default;
SlidingWindow::SlidingWindow(SlidingWindow&&) noexcept = default;
SlidingWindow& SlidingWindow::operator=(SlidingWindow&&) noexcept = default;

absl::Status SlidingWindow::Begin(TimeNs time_ns, const AlignedState& aligned,
                                  std::span<const FeatureSight> sights) {
  return impl_->Begin(time_ns, aligned, sights);
}
absl::Status SlidingWindow::Add(TimeNs time_ns, Preintegration measured,
                                std::span<const FeatureSight> sights) {
  return impl_->Add(time_ns, std::move(measured), sights);
}
absl::Status SlidingWindow::BeginByImages(TimeNs time_ns, const Pose3d& map_T_imu,
                                          const Matrix6d& covariance,
                                          std::span<const FeatureSight> sights) {
  return impl_->BeginByImages(time_ns, map_T_imu, covariance, sights);
}
absl::Status SlidingWindow::AddByImages(TimeNs time_ns, const Pose3d& guess,
                                        std::span<const FeatureSight> sights) {
  return impl_->AddByImages(time_ns, guess, sights);
}
int SlidingWindow::keyframe_count() const { return impl_->keyframe_count(); }
TimeNs SlidingWindow::newest_ns() const { return impl_->newest_ns(); }
InertialState SlidingWindow::newest() const { return impl_->newest(); }
absl::StatusOr<Matrix15d> SlidingWindow::NewestCovariance() const {
  return impl_->NewestCovariance();
}
absl::StatusOr<Matrix6d> SlidingWindow::NewestPoseCovariance() const {
  return impl_->NewestPoseCovariance();
}
std::optional<Vector3d> SlidingWindow::PointOf(int64_t feature_id) const {
  return impl_->PointOf(feature_id);
}
double SlidingWindow::misfit() const { return impl_->misfit(); }
const CalibrationError& SlidingWindow::calibration_error() const {
  return impl_->calibration_error();
}
const std::vector<int64_t>& SlidingWindow::dropped_features() const { return impl_->dropped(); }
const std::vector<SeenLandmark>& SlidingWindow::landmarks() const { return impl_->landmarks(); }

}  // namespace dsg::ingest
