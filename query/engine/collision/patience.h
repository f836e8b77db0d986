// SPDX-License-Identifier: Apache-2.0
// Asks a StopCheck once in a while from loops that are too short to ask each time round.
// Refuses to go on once it was told to stop.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

class Patience {
 public:
  /// `stop` outlives it.
  explicit Patience(const StopCheck& stop) : stop_(stop) {}

  /// To be called at each pair of shapes, which takes a few microseconds at most. False for good
  /// once it must stop.
  bool GoOn() {
    if (++count_ % kAskEvery == 0 && stop_ && status_.ok()) status_ = stop_();
    return status_.ok();
  }
  /// What `stop` returned.
  const absl::Status& status() const { return status_; }

 private:
  static constexpr int64_t kAskEvery = 256;

  const StopCheck& stop_;
  int64_t count_ = 0;
  absl::Status status_;
};

}  // namespace dsg::query
