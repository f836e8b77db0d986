// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/label_parts.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "schema/base/disjoint_sets.h"

namespace dsg::ingest {
namespace {

struct LabelRun {
  PixelRun pixels;
  uint16_t label = 0;
  /// Index of the first run of the same part.
  int parent = 0;
};

class RunFinder {
 public:
  RunFinder(const DepthFrame& frame, const std::vector<int32_t>& class_ids) : frame_(frame) {
    for (const int32_t id : class_ids) {
      if (id > 0 && id < 256) is_wanted_[static_cast<size_t>(id)] = true;
    }
  }

  std::vector<LabelRun> Find() && {
    size_t above_begin = 0;
    for (int row = 0; row < frame_.camera.height; ++row) {
      const size_t begin = runs_.size();
      AddRow(row);
      Join(above_begin, begin);
      above_begin = begin;
    }
    for (size_t i = 0; i < runs_.size(); ++i) runs_[i].parent = parts_.Find(static_cast<int>(i));
    return std::move(runs_);
  }

 private:
  void AddRow(int row) {
    const int width = frame_.camera.width;
    const uint16_t* labels =
        frame_.labels.data() + static_cast<size_t>(row) * static_cast<size_t>(width);
    for (int begin = 0; begin < width;) {
      const uint16_t label = labels[begin];
      int end = begin + 1;
      while (end < width && labels[end] == label) ++end;
      if (is_wanted_[label >> 8]) {
        runs_.push_back({{row, begin, end}, label, parts_.Add()});
      }
      begin = end;
    }
  }

  // Joins the runs of the latest row, from `begin`, with those of the row above that they touch.
  void Join(size_t above, size_t begin) {
    const size_t above_end = begin;
    for (size_t i = begin; i < runs_.size(); ++i) {
      const PixelRun pixels = runs_[i].pixels;
      while (above < above_end && runs_[above].pixels.end < pixels.begin) ++above;
      for (size_t j = above; j < above_end && runs_[j].pixels.begin <= pixels.end; ++j) {
        if (runs_[j].label != runs_[i].label) continue;
        parts_.Merge(static_cast<int>(j), static_cast<int>(i));
      }
    }
  }

  const DepthFrame& frame_;
  std::array<bool, 256> is_wanted_{};
  std::vector<LabelRun> runs_;
  DisjointSets parts_;
};

void Extend(const PixelRun& run, LabelPart* part) {
  if (part->runs.empty()) {
    part->left = run.begin;
    part->right = run.end - 1;
    part->top = run.row;
  }
  part->left = std::min(part->left, run.begin);
  part->right = std::max(part->right, run.end - 1);
  part->bottom = run.row;
  part->pixel_count += run.end - run.begin;
  part->runs.push_back(run);
}

// The first of equally large ones.
void KeepLargestOfInstances(std::vector<LabelPart>* parts) {
  std::map<uint16_t, size_t> largest;
  std::map<uint16_t, int> total;
  for (size_t i = 0; i < parts->size(); ++i) {
    const LabelPart& part = (*parts)[i];
    if ((part.label & 255u) == 0) continue;
    total[part.label] += part.pixel_count;
    const auto [known, is_new] = largest.emplace(part.label, i);
    if (!is_new && part.pixel_count > (*parts)[known->second].pixel_count) known->second = i;
  }
  std::vector<LabelPart> kept;
  for (size_t i = 0; i < parts->size(); ++i) {
    LabelPart& part = (*parts)[i];
    const auto known = largest.find(part.label);
    if (known != largest.end() && known->second != i) continue;
    if (known != largest.end()) part.scattered_count = total[part.label] - part.pixel_count;
    kept.push_back(std::move(part));
  }
  *parts = std::move(kept);
}

}  // namespace

std::vector<LabelPart> FindLabelParts(const DepthFrame& frame,
                                      const std::vector<int32_t>& class_ids, int pixel_count_min) {
  if (frame.labels.empty()) return {};
  const std::vector<LabelRun> runs = RunFinder(frame, class_ids).Find();
  std::vector<int> part_of(runs.size(), -1);
  std::vector<LabelPart> parts;
  for (size_t i = 0; i < runs.size(); ++i) {
    int& part = part_of[static_cast<size_t>(runs[i].parent)];
    if (part < 0) {
      part = static_cast<int>(parts.size());
      parts.emplace_back().label = runs[i].label;
    }
    Extend(runs[i].pixels, &parts[static_cast<size_t>(part)]);
  }
  KeepLargestOfInstances(&parts);
  std::erase_if(parts, [&](const LabelPart& p) { return p.pixel_count < pixel_count_min; });
  return parts;
}

}  // namespace dsg::ingest
