// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/corridor_arms.h"

#include <algorithm>
#include <cmath>

#include "ingest/rooms/outline.h"

namespace dsg::ingest {
namespace {

/// The plan turned so that most walls run along its axes.
struct TurnedPlan {
  GridFrame frame;
  Eigen::Matrix2d map_R_turned = Eigen::Matrix2d::Identity();
  std::vector<int> region_of;
};

// 0 for plans that lie nearly along the axes.
double MainDirection(const PlanRegions& regions, double straight_rad) {
  const double angle = MainAngle(OutlinesOf(regions), 0.0);
  return std::abs(angle) < straight_rad ? 0.0 : angle;
}

TurnedPlan Turn(const PlanRegions& regions, double angle) {
  TurnedPlan turned;
  turned.frame = regions.frame;
  if (angle == 0.0) {
    turned.region_of = regions.region_of;
    return turned;
  }
  turned.map_R_turned = Eigen::Rotation2Dd(angle).toRotationMatrix();
  Eigen::AlignedBox2d box;
  const Eigen::Vector2d low = regions.frame.origin_map.head<2>();
  const Eigen::Vector2d size = regions.frame.cell_m * regions.frame.size.head<2>().cast<double>();
  for (const double x : {0.0, size.x()}) {
    for (const double y : {0.0, size.y()}) {
      box.extend(turned.map_R_turned.transpose() * (low + Eigen::Vector2d(x, y)));
    }
  }
  turned.frame.origin_map.head<2>() = box.min();
  turned.frame.size.head<2>() = (box.sizes() / turned.frame.cell_m).array().ceil().cast<int>();
  turned.region_of.resize(static_cast<size_t>(turned.frame.CellCount()));
  for (int64_t i = 0; i < turned.frame.CellCount(); ++i) {
    const Eigen::Vector3d at = turned.frame.Center(turned.frame.Cell(i));
    turned.region_of[static_cast<size_t>(i)] = regions.At(turned.map_R_turned * at.head<2>());
  }
  return turned;
}

// For each cell, how many cells in a row along one axis are of its region.
std::vector<int> RunLengths(const TurnedPlan& plan, bool along_x) {
  const int lines = along_x ? plan.frame.size.y() : plan.frame.size.x();
  const int length = along_x ? plan.frame.size.x() : plan.frame.size.y();
  const int64_t step = along_x ? 1 : plan.frame.size.x();
  const int64_t next_line = along_x ? plan.frame.size.x() : 1;
  std::vector<int> runs(plan.region_of.size(), 0);
  for (int line = 0; line < lines; ++line) {
    const int64_t first = line * next_line;
    for (int begin = 0; begin < length;) {
      const int region = plan.region_of[static_cast<size_t>(first + begin * step)];
      int end = begin + 1;
      while (end < length && plan.region_of[static_cast<size_t>(first + end * step)] == region) {
        ++end;
      }
      for (int i = begin; i < end; ++i) runs[static_cast<size_t>(first + i * step)] = end - begin;
      begin = end;
    }
  }
  return runs;
}

/// Shapes of all regions, in cells.
struct Shape {
  int width = 0;
  int64_t cell_count = 0;
  bool IsNet(double cell_m, const CorridorOptions& options) const {
    const double length = static_cast<double>(cell_count) / std::max(1, width);
    return width * cell_m <= options.width_m_max && length >= options.net_slenderness * width;
  }
  // Least length of its arms, in cells.
  double ArmMin(double cell_m, const CorridorOptions& options) const {
    return std::max(options.arm_slenderness * width, options.arm_m_min / cell_m);
  }
};

std::vector<Shape> ShapesOf(const TurnedPlan& plan, int count, const std::vector<int>& narrow) {
  std::vector<std::vector<int>> widths(static_cast<size_t>(count));
  for (size_t i = 0; i < narrow.size(); ++i) {
    if (plan.region_of[i] >= 0) widths[static_cast<size_t>(plan.region_of[i])].push_back(narrow[i]);
  }
  std::vector<Shape> shapes(widths.size());
  for (size_t region = 0; region < shapes.size(); ++region) {
    if (widths[region].empty()) continue;
    const auto middle = widths[region].begin() + static_cast<int64_t>(widths[region].size() / 2);
    std::nth_element(widths[region].begin(), middle, widths[region].end());
    shapes[region] = {*middle, static_cast<int64_t>(widths[region].size())};
  }
  return shapes;
}

// Straight pieces of the nets, in the turned plan; along x and along y apart.
PlanRegions FindArms(const TurnedPlan& plan, const std::vector<Shape>& shapes,
                     const CorridorOptions& options) {
  const std::vector<int> along_x = RunLengths(plan, true);
  const std::vector<int> along_y = RunLengths(plan, false);
  const size_t count = plan.region_of.size();
  PlanRegions arms{plan.frame, std::vector<int>(count, -1), 0};
  for (const bool is_x : {true, false}) {
    std::vector<uint8_t> is_member(count, 0);
    for (size_t i = 0; i < count; ++i) {
      if (plan.region_of[i] < 0) continue;
      const Shape& shape = shapes[static_cast<size_t>(plan.region_of[i])];
      if (!shape.IsNet(plan.frame.cell_m, options)) continue;
      const int along = is_x ? along_x[i] : along_y[i];
      const int across = is_x ? along_y[i] : along_x[i];
      const bool is_junction = std::min(along, across) > options.junction_widths * shape.width;
      const double arm_min = shape.ArmMin(plan.frame.cell_m, options);
      is_member[i] = !is_junction && along > across && along >= arm_min ? 1 : 0;
    }
    const PlanRegions straight = LabelRegions(plan.frame, is_member, 1.0);
    for (size_t i = 0; i < count; ++i) {
      if (straight.region_of[i] >= 0) arms.region_of[i] = arms.count + straight.region_of[i];
    }
    arms.count += straight.count;
  }
  return arms;
}

// Only arms long enough by themselves count: a run may go on through a junction.
std::vector<bool> AreLong(const PlanRegions& arms, const TurnedPlan& plan,
                          const std::vector<Shape>& shapes, const CorridorOptions& options) {
  std::vector<Eigen::AlignedBox2i> boxes(static_cast<size_t>(arms.count));
  std::vector<double> length_min(boxes.size(), 0.0);
  for (int64_t i = 0; i < arms.frame.CellCount(); ++i) {
    const int arm = arms.region_of[static_cast<size_t>(i)];
    if (arm < 0) continue;
    boxes[static_cast<size_t>(arm)].extend(Eigen::Vector2i(arms.frame.Cell(i).head<2>()));
    const Shape& shape = shapes[static_cast<size_t>(plan.region_of[static_cast<size_t>(i)])];
    length_min[static_cast<size_t>(arm)] = shape.ArmMin(arms.frame.cell_m, options);
  }
  std::vector<bool> are_long(boxes.size());
  for (size_t arm = 0; arm < boxes.size(); ++arm) {
    are_long[arm] = boxes[arm].sizes().maxCoeff() + 1 >= length_min[arm];
  }
  return are_long;
}

}  // namespace

void SplitCorridors(const CorridorOptions& options, PlanRegions* regions) {
  const TurnedPlan plan = Turn(*regions, MainDirection(*regions, options.straight_rad));
  std::vector<int> narrow = RunLengths(plan, true);
  const std::vector<int> along_y = RunLengths(plan, false);
  for (size_t i = 0; i < narrow.size(); ++i) narrow[i] = std::min(narrow[i], along_y[i]);
  const std::vector<Shape> shapes = ShapesOf(plan, regions->count, narrow);
  PlanRegions arms = FindArms(plan, shapes, options);
  KeepRegions(AreLong(arms, plan, shapes, options), &arms);
  // The first arm of a net goes on under its number.
  std::vector<int> first_arm(shapes.size(), -1);
  std::vector<int> region_of_arm(static_cast<size_t>(arms.count), -1);
  for (size_t i = 0; i < arms.region_of.size(); ++i) {
    const int arm = arms.region_of[i];
    if (arm < 0 || region_of_arm[static_cast<size_t>(arm)] >= 0) continue;
    int& first = first_arm[static_cast<size_t>(plan.region_of[i])];
    region_of_arm[static_cast<size_t>(arm)] = first < 0 ? plan.region_of[i] : regions->count++;
    if (first < 0) first = arm;
  }
  // Cells of nets are taken away, and given back to the nearest arm.
  std::vector<uint8_t> may_grow(regions->region_of.size(), 0);
  for (int64_t i = 0; i < regions->frame.CellCount(); ++i) {
    int& region = regions->region_of[static_cast<size_t>(i)];
    if (region < 0 || first_arm[static_cast<size_t>(region)] < 0) continue;
    const Eigen::Vector3d at = regions->frame.Center(regions->frame.Cell(i));
    const int arm = arms.At(plan.map_R_turned.transpose() * at.head<2>());
    may_grow[static_cast<size_t>(i)] = 1;
    region = arm < 0 ? -1 : region_of_arm[static_cast<size_t>(arm)];
  }
  GrowRegions(may_grow, 1e6, regions);
}

}  // namespace dsg::ingest
