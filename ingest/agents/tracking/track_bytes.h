// SPDX-License-Identifier: Apache-2.0
// What was seen of a person as bytes and back, for tracks that wait on disk.
// The form is of one process: it goes by this machine's byte order and has no version.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "ingest/agents/estimation/torso_graph.h"
#include "ingest/agents/person_observation.h"

namespace dsg::ingest {

/// Without meshes and coefficients. 1.2 kB a pair with joints, 0.4 without, and 0.1 for each cue.
/// Requires: as many of one as of the other.
std::string EncodeTrack(const std::vector<PersonObservation>& observations,
                        const std::vector<TorsoEstimate>& estimates);

/// False if these are no bytes of a track of `count` pairs.
bool DecodeTrack(std::string_view bytes, size_t count, std::vector<PersonObservation>* observations,
                 std::vector<TorsoEstimate>* estimates);

}  // namespace dsg::ingest
