// SPDX-License-Identifier: Apache-2.0
// Curves over days as a picture: one panel above the other, each with its lines.
// Refuses to choose the data's scale but from zero.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::test {

struct Curve {
  std::string name;
  uint32_t rgb = 0;
  /// One value a day.
  std::vector<double> values;
};

struct Panel {
  std::string title;
  std::vector<Curve> curves;
};

/// PNG bytes.
absl::StatusOr<std::string> DrawYear(const std::vector<Panel>& panels);

}  // namespace dsg::test
