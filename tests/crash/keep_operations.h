// SPDX-License-Identifier: Apache-2.0
// Everything that a program can be killed in the middle of: its command line, and what must hold
// of the store after a kill and after the same command was run again to its end.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/crash/keep_rig.h"

namespace dsg::test {

/// The store after a program ended or was killed.
struct Aftermath {
  const KeepRig& rig;
  /// Holds "store" and what the operation wrote beside it.
  std::string place;
  /// It ran to its end, now or at the second time.
  bool is_done = false;
  MapContent main;
  MapContent other;
  /// The newest content of the main map after an undisturbed run; empty while that is being made.
  std::string undisturbed;
};

struct KeepOperation {
  std::string name;
  /// Needs a store of its own kind.
  std::function<std::string(KeepRig&)> make_place = [](KeepRig& rig) { return rig.MakePlace(); };
  /// Program and arguments.
  std::function<std::vector<std::string>(const KeepRig&, const std::string& place)> command;
  /// What is wrong; empty if nothing is. What Verify finds is looked at elsewhere.
  std::function<std::string(const Aftermath&)> violation;
  /// A killed program may have done all of it, and is refused with this reason when it runs again.
  std::string done_reason = "";
  /// Map whose soundness is checked, and that may be missing.
  bool may_be_of_old_format = false;
};

/// All of them. Those whose verb this build does not have are left out and named in `missing`.
std::vector<KeepOperation> KeepOperations(std::vector<std::string>* missing);

/// What must hold after any operation but those that rewrite the past: no looked-at revision lost
/// or changed, the tag there, the other map untouched.
std::string PastViolation(const Aftermath& after, const std::vector<Revision>& readable);

/// Looks at a place: soundness of the maps goes to `problems`.
Aftermath LookAt(const KeepRig& rig, const KeepOperation& operation, const std::string& place,
                 bool is_done, std::string* problems);

/// Runs a program to its end; its output goes to `place`/output. The exit code.
int RunToEnd(const std::vector<std::string>& command, const std::string& place);

}  // namespace dsg::test
