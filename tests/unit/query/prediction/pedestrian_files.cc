// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/prediction/pedestrian_files.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>

#include "schema/base/check.h"

namespace dsg::query {
namespace {

constexpr TimeNs kFrameNs = 400'000'000;

Eigen::Vector3d Raised(const Eigen::Vector2d& position) {
  return {position.x(), position.y(), 0.0};
}

void ScoreWindow(const std::vector<Eigen::Vector2d>& window, const Predictor& predictor,
                 WindowScore* score) {
  std::vector<PathPoint> path;
  for (int i = 0; i < kSeenCount; ++i) path.push_back({i * kFrameNs, Raised(window[i])});
  std::vector<TimeNs> at_ns;
  for (int i = 0; i < kPredictedCount; ++i) at_ns.push_back((kSeenCount + i) * kFrameNs);
  const PredictedPath predicted = predictor(path, at_ns);
  double error_m = 0.0;
  for (int i = 0; i < kPredictedCount; ++i) {
    error_m = (predicted.positions_map[i] - Raised(window[kSeenCount + i])).norm();
    score->ade_m += error_m / kPredictedCount;
  }
  score->fde_m += error_m;
  ++score->window_count;
}

}  // namespace

Predictor LastStep() {
  return [](const std::vector<PathPoint>& path, const std::vector<TimeNs>& at_ns) {
    return PredictConstantVelocity(path, at_ns, {});
  };
}

Predictor Weighted() {
  return [](const std::vector<PathPoint>& path, const std::vector<TimeNs>& at_ns) {
    ConstantVelocityOptions options;
    options.decay = 0.4;
    options.damping = std::pow(0.98, 1.0 / 0.4);
    return PredictConstantVelocity(path, at_ns, options);
  };
}

Predictor Adaptive(const WeightedVelocityOptions& options) {
  return [options](const std::vector<PathPoint>& path, const std::vector<TimeNs>& at_ns) {
    return PredictWeightedVelocity(path, at_ns, options);
  };
}

Pedestrians ReadPedestrians(const std::string& file, int x_column, int y_column) {
  std::ifstream stream(file);
  Pedestrians pedestrians;
  std::string line;
  while (std::getline(stream, line)) {
    std::istringstream text(line);
    const std::vector<double> row{std::istream_iterator<double>(text), {}};
    if (row.empty()) continue;
    DSG_CHECK(static_cast<size_t>(std::max(x_column, y_column)) < row.size());
    pedestrians[std::llround(row[1])][std::llround(row[0])] = {row[x_column], row[y_column]};
  }
  return pedestrians;
}

void ScoreWindows(const Pedestrians& pedestrians, int64_t frame_step, const Predictor& predictor,
                  WindowScore* score) {
  for (const auto& [person, positions] : pedestrians) {
    for (const auto& [frame, position] : positions) {
      std::vector<Eigen::Vector2d> window;
      for (int i = 0; i < kSeenCount + kPredictedCount; ++i) {
        const auto found = positions.find(frame + i * frame_step);
        if (found == positions.end()) break;
        window.push_back(found->second);
      }
      if (window.size() == kSeenCount + kPredictedCount) ScoreWindow(window, predictor, score);
    }
  }
}

WindowScore Means(const WindowScore& sums) {
  return {sums.ade_m / sums.window_count, sums.fde_m / sums.window_count, sums.window_count};
}

Pedestrians Resample(const Pedestrians& pedestrians, int64_t step) {
  Pedestrians resampled;
  for (const auto& [person, rows] : pedestrians) {
    if (rows.size() < 2) continue;
    const int64_t first = (rows.begin()->first + step / 2) / step * step;
    const int64_t last = (rows.rbegin()->first + step / 2) / step * step;
    auto from = rows.begin();
    auto to = std::next(from);
    for (int64_t frame = first; frame <= last; frame += step) {
      while (to->first <= frame && std::next(to) != rows.end()) from = to++;
      const double share =
          static_cast<double>(frame - from->first) / static_cast<double>(to->first - from->first);
      const Eigen::Vector2d position = from->second + share * (to->second - from->second);
      resampled[person][frame] = (position * 100.0).array().round() / 100.0;
    }
  }
  return resampled;
}

}  // namespace dsg::query
