// SPDX-License-Identifier: Apache-2.0
// Body shapes, as of a revision.
#include "schema/store/sqlite/shape_reader.h"
#include "schema/store/sqlite/snapshot.h"

namespace dsg::sqlite {

absl::Status SqliteSnapshot::ReadShapes(NodeId agent, TimeNs from_ns, TimeNs to_ns,
                                        bool with_vertices, const StopCheck& stop,
                                        const std::function<bool(const ShownShape&)>& visit) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  const ShapeQuestion question{agent, revision(), from_ns, to_ns, with_vertices};
  return ShapeReader(*lease, &reader_->shapes(), question).Read(stop, visit);
}

}  // namespace dsg::sqlite
