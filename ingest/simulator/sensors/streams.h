// SPDX-License-Identifier: Apache-2.0
// Which random numbers belong to which noise of which frame, so that a frame's bytes depend on
// the seed and its index only, whoever renders it.
// Refuses to share a stream between two noises.
#pragma once

#include <cstdint>

namespace dsg::simulator {

enum class FrameNoise : uint64_t { kLeft, kRight, kColor, kDepth, kLabels, kInstances };

/// The stream of a noise in a frame. The 256 streams from here on belong to it too.
inline uint64_t FrameStream(FrameNoise noise, int64_t frame) {
  // The world's streams are small, the walkers' begin at 2^32 (walker.cc).
  constexpr uint64_t kFirst = uint64_t{1} << 48;
  return kFirst + ((static_cast<uint64_t>(frame) * 8 + static_cast<uint64_t>(noise)) << 8);
}

}  // namespace dsg::simulator
