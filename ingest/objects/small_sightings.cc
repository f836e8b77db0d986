// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/small_sightings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "ingest/objects/label_parts.h"

namespace dsg::ingest {
namespace {

// Beside the outline depth cameras are blind; further away is something else. Pixels.
constexpr std::array<int, 3> kOutsidePx = {3, 5, 7};

class Part {
 public:
  Part(const DepthFrame& frame, const LabelPart& part, const SmallOptions& options)
      : frame_(frame), part_(part), span_m_max_(options.span_m), options_(options.sighting) {}

  std::optional<SmallSighting> Sight() {
    if (!FindDepth()) return std::nullopt;
    SmallSighting seen;
    seen.class_id = part_.label >> 8;
    seen.depth_m = 0.5 * (low_m_ + high_m_);
    FindBox(&seen);
    seen.covariance_m2 = Covariance(seen);
    LookAround(&seen);
    if (seen.span_m <= span_m_max_) AddPoints(&seen);
    return seen;
  }

 private:
  struct Reading {
    int column = 0;
    int row = 0;
    double depth_m = 0.0;
  };

  size_t IndexOf(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(frame_.camera.width) +
           static_cast<size_t>(column);
  }

  size_t CountMax() const { return static_cast<size_t>(options_.reading_count_max); }

  bool IsDynamic(size_t index) const {
    return !frame_.dynamic.empty() && frame_.dynamic[index] != 0;
  }

  double NoiseAt(double depth_m) const {
    const double per_m2 = frame_.is_stereo ? options_.stereo_noise_per_m2 : options_.noise_per_m2;
    return options_.noise_m + per_m2 * depth_m * depth_m;
  }

  Eigen::Vector3d PointOf(const Reading& reading) const {
    const CameraCalibration& camera = frame_.camera;
    return frame_.map_T_camera *
           Eigen::Vector3d((reading.column - camera.cx) / camera.fx * reading.depth_m,
                           (reading.row - camera.cy) / camera.fy * reading.depth_m,
                           reading.depth_m);
  }

  // The readings of the depths that most pixels share.
  bool FindDepth() {
    const size_t step = 1 + static_cast<size_t>(part_.pixel_count) / CountMax();
    size_t count = 0, looked = 0;
    for (const PixelRun& run : part_.runs) {
      for (int column = run.begin; column < run.end; ++column) {
        if (count++ % step != 0) continue;
        ++looked;
        const size_t index = IndexOf(column, run.row);
        dynamic_count_ += IsDynamic(index) ? 1 : 0;
        const double depth_m = frame_.depth_m[index];
        if (depth_m > 0.0) readings_.push_back({column, run.row, depth_m});
      }
    }
    looked_count_ = looked;
    const auto read = static_cast<double>(readings_.size());
    if (std::ssize(readings_) < options_.reading_count_min ||
        read < options_.read_share_min * static_cast<double>(looked)) {
      return false;
    }
    KeepSharedDepths();
    return std::ssize(readings_) >= options_.reading_count_min && low_m_ >= options_.near_m &&
           high_m_ <= options_.far_m;
  }

  void KeepSharedDepths() {
    std::vector<double> depths;
    for (const Reading& reading : readings_) depths.push_back(reading.depth_m);
    std::nth_element(depths.begin(), depths.begin() + std::ssize(depths) / 2, depths.end());
    const double bin_m = std::max(options_.depth_bin_m, 1.5 * NoiseAt(depths[depths.size() / 2]));
    // All that is too far to be of use is in one bin.
    const double far_m = 2.0 * options_.far_m;
    const auto bin_of = [bin_m, far_m](double depth_m) {
      return static_cast<int>(std::min(depth_m, far_m) / bin_m);
    };
    int first = bin_of(readings_.front().depth_m), last = first;
    for (const Reading& reading : readings_) {
      first = std::min(first, bin_of(reading.depth_m));
      last = std::max(last, bin_of(reading.depth_m));
    }
    std::vector<int> counts(static_cast<size_t>(last - first + 1), 0);
    for (const Reading& reading : readings_) {
      ++counts[static_cast<size_t>(bin_of(reading.depth_m) - first)];
    }
    const auto peak = std::max_element(counts.begin(), counts.end());
    const double least = options_.rare_share * *peak;
    auto begin = peak, end = peak + 1;
    while (begin != counts.begin() && *std::prev(begin) > least) --begin;
    while (end != counts.end() && *end > least) ++end;
    low_m_ = bin_m * static_cast<double>(first + (begin - counts.begin()));
    high_m_ = bin_m * static_cast<double>(first + (end - counts.begin()));
    std::erase_if(readings_, [this](const Reading& reading) {
      return reading.depth_m < low_m_ || reading.depth_m > high_m_;
    });
  }

  void FindBox(SmallSighting* seen) {
    points_map_.clear();
    for (const Reading& reading : readings_) points_map_.push_back(PointOf(reading));
    for (int axis = 0; axis < 3; ++axis) {
      const auto [low, high] = RangeAlong(Eigen::Vector3d::Unit(axis));
      box_map_.min()[axis] = low;
      box_map_.max()[axis] = high;
    }
    seen->box_map = box_map_;
    seen->hidden_map = Hidden();
    seen->center_map = box_map_.center() + 0.5 * seen->hidden_map;
    seen->span_m = box_map_.diagonal().norm();
  }

  std::pair<double, double> RangeAlong(const Eigen::Vector3d& axis) const {
    std::vector<double> values;
    for (const Eigen::Vector3d& point : points_map_) values.push_back(axis.dot(point));
    std::sort(values.begin(), values.end());
    const auto cut =
        static_cast<size_t>(std::ceil(options_.trim_share * static_cast<double>(values.size())));
    const size_t low = std::min(cut, (values.size() - 1) / 2);
    return {values[low], values[values.size() - 1 - low]};
  }

  Eigen::Vector3d Hidden() const {
    Eigen::Vector3d along = box_map_.center() - frame_.map_T_camera.position;
    along.z() = 0.0;
    if (along.norm() < 1e-3) return Eigen::Vector3d::Zero();
    along.normalize();
    const auto [near_m, far_m] = RangeAlong(along);
    const auto [left_m, right_m] = RangeAlong(Eigen::Vector3d(-along.y(), along.x(), 0.0));
    const double width_m = right_m - left_m;
    if (box_map_.sizes().z() < options_.high_min * width_m) return Eigen::Vector3d::Zero();
    return std::clamp(width_m - (far_m - near_m), 0.0, span_m_max_) * along;
  }

  // Along the ray the back is not seen; across it the outline wanders.
  Eigen::Matrix3d Covariance(const SmallSighting& seen) const {
    const Eigen::Vector3d ray = (seen.center_map - frame_.map_T_camera.position).normalized();
    const double across_m = 0.01 + options_.outline_px * seen.depth_m / frame_.camera.fx;
    const double back_m = options_.back_share * std::min(seen.span_m, span_m_max_);
    const double along_m = std::hypot(across_m, 0.5 * NoiseAt(seen.depth_m), back_m);
    const Eigen::Matrix3d ray_ray = ray * ray.transpose();
    return across_m * across_m * (Eigen::Matrix3d::Identity() - ray_ray) +
           along_m * along_m * ray_ray;
  }

  enum class Beside { kNothing, kFree, kBefore, kPerson };

  // What is beside an outline pixel, in one direction.
  Beside LookBeside(int column, int row, int dx, int dy) const {
    for (const int step : kOutsidePx) {
      const int x = column + step * dx;
      const int y = row + step * dy;
      if (x < 0 || y < 0 || x >= frame_.camera.width || y >= frame_.camera.height) break;
      const size_t index = IndexOf(x, y);
      const double depth_m = frame_.depth_m[index];
      if (depth_m <= 0.0 || frame_.labels[index] == part_.label) continue;
      const double margin_m = options_.before_m + 3.0 * NoiseAt(low_m_);
      if (IsDynamic(index)) {
        if (std::abs(depth_m - 0.5 * (low_m_ + high_m_)) <= options_.hand_m) return Beside::kPerson;
        return depth_m < low_m_ ? Beside::kBefore : Beside::kFree;
      }
      if (depth_m >= low_m_ - margin_m) return Beside::kFree;
      const double height_m = PointOf({x, y, depth_m}).z();
      return height_m > box_map_.min().z() + options_.above_foot_m ? Beside::kBefore
                                                                   : Beside::kFree;
    }
    return Beside::kNothing;
  }

  void LookAround(SmallSighting* seen) const {
    std::array<int, 4> counts{};
    const auto look = [&](int column, int row, int dx, int dy) {
      ++counts[static_cast<size_t>(LookBeside(column, row, dx, dy))];
    };
    for (const PixelRun& run : part_.runs) {
      look(run.begin, run.row, -1, 0);
      look(run.end - 1, run.row, 1, 0);
    }
    const size_t step = 1 + part_.runs.size() / CountMax();
    for (size_t i = 0; i < part_.runs.size(); i += step) {
      const PixelRun& run = part_.runs[i];
      if (run.row - part_.top > 1 && part_.bottom - run.row > 1) continue;
      for (int column = run.begin; column < run.end; ++column) {
        look(column, run.row, 0, run.row - part_.top <= 1 ? -1 : 1);
      }
    }
    const auto share = [&](Beside what) {
      const int all = counts[1] + counts[2] + counts[3];
      return all == 0 ? 0.0 : static_cast<double>(counts[static_cast<size_t>(what)]) / all;
    };
    const double dynamic_share =
        static_cast<double>(dynamic_count_) / static_cast<double>(looked_count_);
    seen->is_held = share(Beside::kPerson) >= options_.held_share_min ||
                    dynamic_share >= 2 * options_.held_share_min;
    const bool is_inside = part_.left >= options_.border_px && part_.top >= options_.border_px &&
                           part_.right < frame_.camera.width - options_.border_px &&
                           part_.bottom < frame_.camera.height - options_.border_px;
    seen->is_whole = is_inside && !seen->is_held &&
                     share(Beside::kBefore) <= options_.hidden_share_max &&
                     part_.scattered_count <= options_.scattered_share_max * part_.pixel_count;
  }

  void AddPoints(SmallSighting* seen) const {
    const size_t step = 1 + points_map_.size() / static_cast<size_t>(options_.point_count_max);
    const Box3d box(box_map_.min().array() - 1e-9, box_map_.max().array() + 1e-9);
    std::array<std::vector<uint8_t>, 3> channels;
    for (size_t i = 0; i < points_map_.size(); i += step) {
      if (!box.contains(points_map_[i])) continue;
      seen->points_map.push_back(points_map_[i].cast<float>());
      if (frame_.rgb.empty()) continue;
      const size_t index = 3 * IndexOf(readings_[i].column, readings_[i].row);
      for (size_t channel = 0; channel < 3; ++channel) {
        channels[channel].push_back(frame_.rgb[index + channel]);
      }
    }
    if (channels[0].empty()) return;
    for (size_t channel = 0; channel < 3; ++channel) {
      std::vector<uint8_t>& values = channels[channel];
      const auto middle = values.begin() + std::ssize(values) / 2;
      std::nth_element(values.begin(), middle, values.end());
      seen->color[channel] = *middle;
    }
    seen->color[3] = 255;
  }

  const DepthFrame& frame_;
  const LabelPart& part_;
  double span_m_max_;
  const SightingOptions& options_;
  std::vector<Reading> readings_;
  std::vector<Eigen::Vector3d> points_map_;
  Box3d box_map_;
  double low_m_ = 0.0;
  double high_m_ = 0.0;
  size_t looked_count_ = 0;
  size_t dynamic_count_ = 0;
};

}  // namespace

std::vector<SmallSighting> FindSmallSightings(const DepthFrame& frame,
                                              const std::vector<int32_t>& class_ids,
                                              const SmallOptions& options) {
  std::vector<SmallSighting> sightings;
  for (const LabelPart& part : FindLabelParts(frame, class_ids, options.sighting.pixel_count_min)) {
    std::optional<SmallSighting> seen = Part(frame, part, options).Sight();
    if (seen.has_value()) sightings.push_back(std::move(*seen));
  }
  return sightings;
}

}  // namespace dsg::ingest
