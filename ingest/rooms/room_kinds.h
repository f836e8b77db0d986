// SPDX-License-Identifier: Apache-2.0
// What homes and offices hold: kinds of rooms with their usual furniture, and its other names.
// Plain tables of general knowledge; refuses to be fitted to any data set.
#pragma once

#include <span>
#include <string_view>

namespace dsg::ingest {

/// How many of a thing a room is expected to hold.
struct ExpectedThing {
  const char* name;
  double count;
};

struct RoomKind {
  const char* name;
  /// How common such rooms are, against each other.
  double prior;
  std::span<const ExpectedThing> things;
};

std::span<const RoomKind> RoomKinds();

/// The name that the tables use for a thing. `name`: lower case, single spaces.
std::string_view CommonNameOf(std::string_view name);

}  // namespace dsg::ingest
