// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/detector.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "ingest/simulator/body/detection_error.h"
#include "schema/base/random.h"

namespace dsg::simulator {
namespace {

constexpr uint64_t kDetectionStream = uint64_t{1} << 62;
constexpr uint64_t kFalseStream = uint64_t{1} << 61;
constexpr int kBisectionCount = 40;
/// Everything in doubt is an outlier at this scale already.
constexpr double kScaleMax = 20.0;
// With few detections the mean is luck, and no reason for outliers everywhere.
constexpr double kFewScaleMax = 4.0;
constexpr double kPixelNoisePx = 1.0;
constexpr double kShapeNoise = 0.4;
constexpr double kRotationNoiseRad = 0.08;
constexpr double kOccludedRotationNoiseRad = 0.3;
constexpr double kCropMargin = 1.2;
/// Nearer points have no sensible pixel.
constexpr double kProjectDepthMinM = 0.1;

/// A view with its luck.
struct Sample {
  const BodyView* view = nullptr;
  Pose3d map_T_camera;
  Eigen::Vector3d torso_camera = Eigen::Vector3d::Zero();
  DetectionDraws draws;

  Eigen::Vector3d Torso(double scale) const {
    return DetectedTorso(torso_camera, view->visibility, scale, draws);
  }
  double ErrorM(double scale) const { return (Torso(scale) - torso_camera).norm(); }
};

double LongerSide(const Eigen::Vector4d& box) { return std::max(box[2] - box[0], box[3] - box[1]); }

bool IsDetected(const BodyView& view, const DetectorOptions& options) {
  return view.visibility >= options.visibility_min &&
         LongerSide(view.box_px) >= options.box_side_min_px;
}

std::vector<Sample> MakeSamples(const std::vector<BodyView>& views, const CameraPoseOf& pose_of,
                                uint64_t seed, const DetectorOptions& options) {
  std::vector<Sample> samples;
  for (const BodyView& view : views) {
    if (!IsDetected(view, options)) continue;
    Sample sample;
    sample.view = &view;
    sample.map_T_camera = pose_of(view);
    sample.torso_camera = sample.map_T_camera.Inverse() * view.state.joints_map[ingest::kPelvis];
    // Beside or behind the lens, with an arm in the picture: nothing a network knows.
    if (sample.torso_camera.z() < kDetectionDepthMinM) continue;
    if (sample.torso_camera.norm() > options.range_m_max) continue;
    Random random(seed, kDetectionStream + (static_cast<uint64_t>(view.frame) << 16) +
                            static_cast<uint64_t>(view.person));
    sample.draws = DrawDetectionErrors(PersonDepthLog(seed, view.person), &random);
    samples.push_back(sample);
  }
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) {
    return std::tie(a.view->time_ns, a.view->frame, a.view->person) <
           std::tie(b.view->time_ns, b.view->frame, b.view->person);
  });
  return samples;
}

double MeanErrorM(const std::vector<Sample>& samples, double scale) {
  double sum = 0.0;
  for (const Sample& sample : samples) sum += sample.ErrorM(scale);
  return samples.empty() ? 0.0 : sum / static_cast<double>(samples.size());
}

// The same draws at every scale, so the mean rises with it but for rare outliers that undo
// another error.
double FindOutlierScale(const std::vector<Sample>& samples, const DetectorOptions& options,
                        DetectionStatistics* statistics) {
  statistics->low_statistics = std::ssize(samples) < kLowStatisticsCount;
  statistics->unscaled_mean_m = MeanErrorM(samples, 1.0);
  if (!options.scale_outliers || samples.empty() ||
      std::abs(statistics->unscaled_mean_m - options.target_mean_m) <= options.target_tolerance_m) {
    return 1.0;
  }
  double low = 0.0;
  double high = statistics->low_statistics ? kFewScaleMax : kScaleMax;
  if (MeanErrorM(samples, low) >= options.target_mean_m) high = low;
  if (MeanErrorM(samples, high) <= options.target_mean_m) low = high;
  for (int i = 0; i < kBisectionCount && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    (MeanErrorM(samples, middle) < options.target_mean_m ? low : high) = middle;
  }
  // The mean is a staircase: one more outlier may lead farther off than none.
  const double low_off_m = std::abs(MeanErrorM(samples, low) - options.target_mean_m);
  const double high_off_m = std::abs(MeanErrorM(samples, high) - options.target_mean_m);
  statistics->off_target = std::min(low_off_m, high_off_m) > options.target_tolerance_m;
  return low_off_m < high_off_m ? low : high;
}

Eigen::Vector2d ProjectClamped(const ingest::CameraCalibration& camera, Eigen::Vector3d point) {
  point.z() = std::max(point.z(), kProjectDepthMinM);
  return ingest::Project(camera, point);
}

Eigen::Vector3d AxisAngle(const Eigen::Quaterniond& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

Eigen::Quaterniond FromAxisAngle(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  if (angle < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle));
}

void SetCoefficients(const Sample& sample, const ShapeCoefficients& shape,
                     ingest::HumanDetection* detection) {
  const BodyState& state = sample.view->state;
  const double visibility = sample.view->visibility;
  const double sd =
      (kRotationNoiseRad + kOccludedRotationNoiseRad * (1.0 - visibility)) / std::sqrt(3.0);
  const bool flipped = IsFlipped(visibility, sample.draws);
  for (int j = 0; j < ingest::kJointCount; ++j) {
    Eigen::Quaterniond rotation = state.pose.rotations[flipped ? MirrorJoint(j) : j];
    if (j == ingest::kPelvis) {
      rotation =
          sample.map_T_camera.orientation.conjugate() * state.map_T_torso.orientation * rotation;
    }
    const Eigen::Vector3d turn =
        AxisAngle(rotation * FromAxisAngle(sd * sample.draws.rotations[j]));
    for (int axis = 0; axis < 3; ++axis) {
      detection->pose_coefficients.push_back(static_cast<float>(turn[axis]));
    }
  }
  for (int i = 0; i < ingest::kShapeCount; ++i) {
    detection->shape_coefficients.push_back(
        static_cast<float>(shape[i] + kShapeNoise * sample.draws.shape[i]));
  }
}

// A joint counts as seen if it is in the box of the visible pixels, as the body as a whole.
void SetVisibilities(const Sample& sample, const ingest::CameraCalibration& camera,
                     ingest::HumanDetection* detection) {
  const Eigen::Vector4d& box = sample.view->box_px;
  const double margin_px = 2.0 + 0.03 * LongerSide(box);
  const Pose3d camera_T_map = sample.map_T_camera.Inverse();
  for (int j = 0; j < ingest::kJointCount; ++j) {
    const Eigen::Vector3d at = camera_T_map * sample.view->state.joints_map[j];
    const Eigen::Vector2d px = ProjectClamped(camera, at);
    const bool inside = at.z() > kProjectDepthMinM && px.x() >= box[0] - margin_px &&
                        px.x() <= box[2] + margin_px && px.y() >= box[1] - margin_px &&
                        px.y() <= box[3] + margin_px;
    detection->joint_visibility[j] = inside ? sample.view->visibility : 0.0;
  }
}

// tz = 2 f / (scale * crop), so that the usual conversion gives the detected torso back.
void SetWeakCamera(const Eigen::Vector3d& torso_camera, const ingest::CameraCalibration& camera,
                   ingest::HumanDetection* detection) {
  const Eigen::Vector4d& box = detection->box_px;
  detection->crop_center_px = 0.5 * Eigen::Vector2d(box[0] + box[2], box[1] + box[3]);
  detection->crop_px = kCropMargin * std::max(1.0, LongerSide(box));
  detection->weak_scale = 2.0 * camera.fx / (detection->crop_px * torso_camera.z());
  const Eigen::Vector2d torso_px = ProjectClamped(camera, torso_camera);
  detection->weak_translation =
      (torso_px - detection->crop_center_px) / (0.5 * detection->weak_scale * detection->crop_px);
}

DetectionOutput MakeOutput(const Sample& sample, const ingest::CameraCalibration& camera,
                           const ShapeCoefficients& shape, double outlier_scale, bool has_body) {
  const BodyView& view = *sample.view;
  const Eigen::Vector3d torso = sample.Torso(outlier_scale);
  DetectionOutput output;
  ingest::HumanDetection& detection = output.detection;
  detection.time_ns = view.time_ns;
  detection.score =
      std::clamp(0.45 + 0.5 * std::sqrt(view.visibility) + 0.04 * sample.draws.score, 0.0, 1.0);
  detection.box_px = view.box_px;
  detection.mask_instance = view.mask_instance;
  const Eigen::Quaterniond camera_R_map = sample.map_T_camera.orientation.conjugate();
  std::array<Eigen::Vector3d, ingest::kJointCount> joints;
  for (int j = 0; j < ingest::kJointCount; ++j) {
    joints[j] = camera_R_map * (view.state.joints_map[j] - view.state.joints_map[0]);
  }
  detection.joints_root = DetectedJoints(joints, view.visibility, sample.draws);
  for (int j = 0; j < ingest::kJointCount; ++j) {
    detection.joints_px[j] = ProjectClamped(camera, torso + detection.joints_root[j]) +
                             kPixelNoisePx * sample.draws.pixels[j];
  }
  SetVisibilities(sample, camera, &detection);
  SetCoefficients(sample, shape, &detection);
  SetWeakCamera(torso, camera, &detection);
  truth::DetectionTruth& truth = output.truth;
  truth.time_ns = view.time_ns;
  truth.human = view.person;
  truth.visibility = view.visibility;
  truth.distance_m = sample.torso_camera.norm();
  truth.touches_border = view.touches_border;
  truth.torso_map = view.state.joints_map[ingest::kPelvis];
  truth.detected_torso_map = sample.map_T_camera * torso;
  if (has_body) output.body = {view.person, view.state.pose, view.state.map_T_torso, camera_R_map};
  return output;
}

// A body of the mean shape that stands upright where nobody is.
Sample FalseSample(const Sample& in_image, const ingest::CameraCalibration& camera, Random* random,
                   BodyView* view) {
  const double depth = random->Uniform(2.0, 8.0);
  const double u = random->Uniform(0.1, 0.9) * camera.width;
  const Eigen::Vector3d torso(depth * (u - camera.cx) / camera.fx, 0.1 * depth, depth);
  const Pose3d& map_T_camera = in_image.map_T_camera;
  view->time_ns = in_image.view->time_ns;
  view->frame = in_image.view->frame;
  view->person = -1;
  view->visibility = random->Uniform(0.3, 1.0);
  view->state.map_T_torso.position = map_T_camera * torso;
  const BodyModel body{ShapeCoefficients()};
  view->state.joints_map = body.Joints(view->state.pose);
  for (Eigen::Vector3d& joint : view->state.joints_map) joint = view->state.map_T_torso * joint;
  const double half_height = 0.9 * camera.fy / depth;
  const double v = camera.cy + 0.1 * camera.fy;
  view->box_px = {std::max(0.0, u - 0.4 * half_height), std::max(0.0, v - half_height),
                  std::min(camera.width - 1.0, u + 0.4 * half_height),
                  std::min(camera.height - 1.0, v + half_height)};
  Sample sample;
  sample.view = view;
  sample.map_T_camera = map_T_camera;
  sample.torso_camera = torso;
  sample.draws = DrawDetectionErrors(0.0, random);
  return sample;
}

void AddFalsePositives(const std::vector<Sample>& samples, const ingest::CameraCalibration& camera,
                       uint64_t seed, const DetectorOptions& options,
                       std::vector<DetectionOutput>* outputs) {
  for (size_t i = 0; i < samples.size(); ++i) {
    const int64_t frame = samples[i].view->frame;
    if (i > 0 && samples[i - 1].view->frame == frame) continue;
    Random random(seed, kFalseStream + static_cast<uint64_t>(frame));
    if (!random.Chance(options.false_positive_rate)) continue;
    BodyView view;
    const Sample sample = FalseSample(samples[i], camera, &random, &view);
    DetectionOutput output =
        MakeOutput(sample, camera, ShapeCoefficients(), 0.0, options.has_bodies);
    output.truth.torso_map = output.truth.detected_torso_map;
    outputs->push_back(std::move(output));
  }
}

bool PassesFilter(const ingest::HumanDetection& detection,
                  const ingest::CameraCalibration& camera) {
  const Eigen::Vector4d& box = detection.box_px;
  return box[0] > kFilterBorderPx && box[1] > kFilterBorderPx &&
         box[2] < camera.width - 1 - kFilterBorderPx &&
         box[3] < camera.height - 1 - kFilterBorderPx && LongerSide(box) > kFilterSidePx;
}

void Count(const std::vector<DetectionOutput>& outputs, const ingest::CameraCalibration& camera,
           DetectionStatistics* statistics) {
  std::vector<double> raw;
  std::vector<double> filtered;
  for (const DetectionOutput& output : outputs) {
    if (output.truth.human < 0) {
      ++statistics->false_positive_count;
      continue;
    }
    const double error_m = (output.truth.detected_torso_map - output.truth.torso_map).norm();
    raw.push_back(error_m);
    if (PassesFilter(output.detection, camera)) filtered.push_back(error_m);
  }
  statistics->raw = Summarize(std::move(raw));
  statistics->filtered = Summarize(std::move(filtered));
}

ErrorSummary SkinErrors(const std::vector<DetectionOutput>& outputs,
                        const std::vector<ShapeCoefficients>& shapes) {
  const std::vector<BodyModel> models(shapes.begin(), shapes.end());
  std::vector<double> errors_m;
  for (const DetectionOutput& output : outputs) {
    if (output.truth.human < 0) continue;
    const BodyModel& model = models[static_cast<size_t>(output.truth.human)];
    const SkinPair skins = MakeSkins(*output.body, model, output.detection.joints_root);
    errors_m.push_back(MeanSkinErrorM(*output.body, skins));
  }
  return Summarize(std::move(errors_m));
}

}  // namespace

DetectorResult MakeDetections(const std::vector<BodyView>& views,
                              const CameraPoseOf& map_T_camera_of,
                              const ingest::CameraCalibration& camera,
                              const std::vector<ShapeCoefficients>& shapes, uint64_t seed,
                              const DetectorOptions& options) {
  DetectorResult result;
  const std::vector<Sample> samples = MakeSamples(views, map_T_camera_of, seed, options);
  DetectionStatistics& statistics = result.statistics;
  statistics.dropped_view_count = static_cast<int>(views.size() - samples.size());
  statistics.outlier_scale = FindOutlierScale(samples, options, &statistics);
  for (const Sample& sample : samples) {
    const ShapeCoefficients& shape = shapes[static_cast<size_t>(sample.view->person)];
    result.outputs.push_back(
        MakeOutput(sample, camera, shape, statistics.outlier_scale, options.has_bodies));
  }
  AddFalsePositives(samples, camera, seed, options, &result.outputs);
  std::stable_sort(result.outputs.begin(), result.outputs.end(),
                   [](const DetectionOutput& a, const DetectionOutput& b) {
                     return a.truth.time_ns < b.truth.time_ns;
                   });
  int64_t id = 0;
  for (DetectionOutput& output : result.outputs) {
    output.detection.id = ++id;
    output.detection.camera = options.camera;
    output.truth.id = id;
  }
  Count(result.outputs, camera, &statistics);
  if (options.has_bodies) statistics.skin = SkinErrors(result.outputs, shapes);
  return result;
}

}  // namespace dsg::simulator
