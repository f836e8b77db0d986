// SPDX-License-Identifier: Apache-2.0
// The part of export that writes an archive.
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "query/cli/archive_copy.h"
#include "query/cli/interrupt.h"
#include "query/cli/progress.h"
#include "query/cli/verbs.h"
#include "query/cli/written.h"
#include "schema/archive/archive_file.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"

namespace dsg::cli {
namespace {

absl::Status CheckAlone(const Session& session, const ExportVerb& verb) {
  const CommonOptions& common = session.common();
  if (common.revision.has_value() || !common.tag.empty() || !verb.at.empty()) {
    return MakeError(Reason::kFieldInvalid,
                     "an archive has all revisions and all times; leave --revision and --at out",
                     {{"field", "--revision"}});
  }
  const bool is_alone =
      verb.ply.empty() && verb.graph_ply.empty() && verb.gltf.empty() && verb.spark.empty();
  if (is_alone) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   "an archive is written alone; export the other files by a call of their own",
                   {{"field", "FILE"}});
}

}  // namespace

absl::Status RunExportArchive(Session* session, const ExportVerb& verb, std::ostream& out,
                              std::ostream& progress_out) {
  DSG_RETURN_IF_ERROR(CheckAlone(*session, verb));
  DSG_RETURN_IF_ERROR(CheckMayWrite(verb.archive, verb.force));
  const std::string& map = session->map().name;
  Progress progress(absl::StrCat("export ", map), &progress_out);
  query::CallContext call = session->NewCall();
  const InterruptGuard guard(&call);
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(verb.archive));
  DSG_RETURN_IF_ERROR(CopyArchive(
      session, map, call, [&](std::string_view bytes) { return file.Write(bytes); },
      [&](double fraction) { progress.Update(fraction); }));
  DSG_RETURN_IF_ERROR(file.Commit());
  // What went through a network is read again before it is called an archive.
  const auto manifest = ReadArchiveFile(verb.archive, nullptr, call.stop(), nullptr);
  if (!manifest.ok()) {
    std::remove(verb.archive.c_str());
    return manifest.status();
  }
  const Written written{.format = "dsgz",
                        .path = verb.archive,
                        .byte_count = file.byte_count(),
                        .counts = {{"database bytes", manifest->database_bytes}}};
  TellWritten({written}, manifest->newest_revision, session->common().json, out);
  return absl::OkStatus();
}

}  // namespace dsg::cli
