// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/detection_statistics.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace dsg::simulator {
namespace {

double Quantile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<size_t>(std::llround(at))];
}

std::string Line(const char* name, const ErrorSummary& errors, double paper_m) {
  return absl::StrFormat(
      "%-9s %6d detections, mean %.2f m (paper %.2f), sd %.2f, median %.2f, p99 %.2f\n", name,
      errors.count, errors.mean_m, paper_m, errors.std_m, errors.median_m, errors.p99_m);
}

}  // namespace

ErrorSummary Summarize(std::vector<double> errors_m) {
  ErrorSummary summary;
  summary.count = static_cast<int>(errors_m.size());
  if (errors_m.empty()) return summary;
  std::sort(errors_m.begin(), errors_m.end());
  double sum = 0.0;
  for (const double error : errors_m) sum += error;
  summary.mean_m = sum / summary.count;
  double squares = 0.0;
  for (const double error : errors_m) squares += std::pow(error - summary.mean_m, 2);
  summary.std_m = std::sqrt(squares / summary.count);
  summary.median_m = Quantile(errors_m, 0.5);
  summary.p99_m = Quantile(errors_m, 0.99);
  return summary;
}

std::string FormatDetectionStatistics(const DetectionStatistics& statistics) {
  std::string text = absl::StrCat(Line("raw", statistics.raw, kPaperRawMeanM),
                                  Line("filtered", statistics.filtered, kPaperFilteredMeanM));
  absl::StrAppendFormat(&text, "outlier rate x %.2f (mean %.2f m without), %d false positives\n",
                        statistics.outlier_scale, statistics.unscaled_mean_m,
                        statistics.false_positive_count);
  if (statistics.skin.count > 0) {
    absl::StrAppendFormat(&text, "vertices  %6d bodies, mean %.3f m from the pelvis, p99 %.3f\n",
                          statistics.skin.count, statistics.skin.mean_m, statistics.skin.p99_m);
  }
  if (statistics.low_statistics) absl::StrAppend(&text, "few detections: figures are uncertain\n");
  if (statistics.off_target) absl::StrAppend(&text, "no outlier rate reaches the paper's mean\n");
  return text;
}

}  // namespace dsg::simulator
