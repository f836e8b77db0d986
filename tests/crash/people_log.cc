// SPDX-License-Identifier: Apache-2.0
#include "tests/crash/people_log.h"

#include <algorithm>
#include <random>
#include <vector>

#include "absl/strings/str_format.h"

namespace dsg::test {
namespace {

constexpr int kFrameStep = 10;
constexpr size_t kAtATime = 20;

struct Walker {
  int person = 0;
  int frames_left = 0;
  double x = 0.0;
  double y = 0.0;
};

}  // namespace

std::string PeopleLog(uint64_t seed, int row_count) {
  std::mt19937_64 engine(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53;
  };
  std::vector<Walker> walkers(kAtATime);
  int persons = 0;
  int rows = 0;
  std::string text;
  for (int frame = 0; rows < row_count; frame += kFrameStep) {
    for (Walker& walker : walkers) {
      if (walker.frames_left-- == 0) {
        walker = {++persons, 30 + static_cast<int>(engine() % 60), uniform(0, 95), uniform(0, 55)};
      }
      walker.x = std::clamp(walker.x + uniform(-0.6, 0.6), 0.0, 95.0);
      walker.y = std::clamp(walker.y + uniform(-0.6, 0.6), 0.0, 55.0);
      // Now and then somebody is not seen.
      if (engine() % 50 == 0) continue;
      absl::StrAppendFormat(&text, "%d %d %.4f %.4f\n", frame, walker.person, walker.x, walker.y);
      if (++rows == row_count) break;
    }
  }
  return text;
}

}  // namespace dsg::test
