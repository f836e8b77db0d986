// SPDX-License-Identifier: Apache-2.0
// What command lines that merge maps say.
// Refuses to know what a transform means: it stays text until it is read.
#pragma once

#include <string>

#include "query/cli/picture_options.h"

namespace dsg::cli {

struct MergeVerb {
  /// Name of the map that is taken in.
  std::string other;
  /// Empty = estimated.
  std::string transform;
  bool dry_run = false;
  /// Although little speaks for the transform.
  bool yes = false;
  PictureOptions picture;
};

}  // namespace dsg::cli
