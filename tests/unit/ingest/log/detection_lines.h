// SPDX-License-Identifier: Apache-2.0
// Detections as text, for the tests of their readers.
#pragma once

#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// `count` copies of `item` in a JSON list.
inline std::string Repeated(const std::string& item, int count) {
  return absl::StrCat(
      "[", absl::StrJoin(std::vector<std::string>(static_cast<size_t>(count), item), ","), "]");
}

/// A whole detection with only numbers that are allowed.
inline std::string DetectionLine(TimeNs time_ns, int64_t id) {
  return absl::StrCat(
      "{\"time_ns\":", time_ns, ",\"camera\":\"cam0\",\"id\":", id,
      ",\"score\":0.9,\"box\":[10.5,20,30,60],\"mask_instance\":3,\"joints\":",
      Repeated("[0.1,-0.2,0.3]", 24), ",\"joints_px\":", Repeated("[20,40.5,1]", 24),
      ",\"pose\":", Repeated("0.25", 72), ",\"shape\":", Repeated("-0.5", 10),
      ",\"weak_camera\":{\"scale\":0.8,\"t\":[0.1,0.2],\"crop_center\":[20,40],\"crop_px\":50}}");
}

}  // namespace dsg::ingest
