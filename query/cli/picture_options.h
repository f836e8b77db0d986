// SPDX-License-Identifier: Apache-2.0
// Where the picture of an answer goes. Plain values; who draws it is query/cli/answer_picture.h.
#pragma once

#include <string>

namespace dsg::cli {

struct PictureOptions {
  /// Empty = no picture.
  std::string png;
  /// A level or room by id or name, or a height; empty = all floors.
  std::string floor;
  int width_px = 1600;
  /// Replace a file that is there.
  bool force = false;
};

}  // namespace dsg::cli
