// SPDX-License-Identifier: Apache-2.0
// The content of an asset, one part a message. Only the part that is being sent is in memory.
#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"
#include "schema/store/snapshot.h"

namespace dsg::query {
namespace {

class AssetCursor final : public EngineCursor<v1::GetAssetResponse> {
 public:
  AssetCursor(const ReadView& view, const Sha256& sha256) : view_(view), sha256_(sha256) {}

  bool done() const override { return next_part_ == part_count_; }

 private:
  absl::Status Fill(const CallContext&, v1::GetAssetResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(AssetPart part, view_.snapshot().ReadAssetPart(sha256_, next_part_));
    if (next_part_ == 0) {
      view_.FillHeader(reply->mutable_header());
      reply->set_media_type(part.media_type);
      reply->set_size_bytes(part.size_bytes);
    }
    *reply->mutable_content() = std::move(part.content);
    part_count_ = part.part_count;
    ++next_part_;
    return absl::OkStatus();
  }

  const ReadView view_;
  const Sha256 sha256_;
  int64_t next_part_ = 0;
  // Known from the first part on.
  int64_t part_count_ = 1;
};

}  // namespace

CursorOr<v1::GetAssetResponse> GetAsset(Engine* engine, const CallContext&,
                                        const v1::GetAssetRequest& request) {
  Sha256 sha256;
  if (request.sha256().size() != sha256.size()) {
    return FieldError("sha256", absl::StrCat(request.sha256().size(), " bytes"),
                      "give the 32 bytes of the content's SHA-256");
  }
  std::copy(request.sha256().begin(), request.sha256().end(), sha256.begin());
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  // An unknown asset is refused at once, and not in the stream.
  DSG_RETURN_IF_ERROR(view.snapshot().ReadAssetPart(sha256, 0).status());
  return std::make_unique<AssetCursor>(view, sha256);
}

}  // namespace dsg::query
