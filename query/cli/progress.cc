// SPDX-License-Identifier: Apache-2.0
#include "query/cli/progress.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_format.h"

namespace dsg::cli {
namespace {

constexpr std::chrono::seconds kPeriod{2};

}  // namespace

Progress::Progress(std::string task, std::ostream* out, Now now)
    : task_(std::move(task)), out_(out), now_(std::move(now)), start_(now_()), last_line_(start_) {}

void Progress::Update(double fraction) {
  const Clock::time_point now = now_();
  if (now - last_line_ < kPeriod) return;
  last_line_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  *out_ << absl::StrFormat("%s: %.0f %%", task_, 100.0 * fraction);
  // A rate from almost nothing done would only mislead.
  if (fraction >= 0.01) {
    *out_ << absl::StrFormat(", %.0f s left", std::ceil(elapsed_s * (1.0 - fraction) / fraction));
  }
  *out_ << std::endl;
}

}  // namespace dsg::cli
