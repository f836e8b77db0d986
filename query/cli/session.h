// SPDX-License-Identifier: Apache-2.0
// One run of the program: the store or server it asks, the map and revision it means; reading
// streams and pages.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <ostream>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "query/api/api.h"
#include "query/cli/answer_text.h"
#include "query/cli/arguments.h"
#include "schema/base/status.h"
#include "schema/model/layer.h"

namespace dsg::cli {

/// Largest page of the services.
inline constexpr int64_t kPageSizeMax = 1000;

/// The maximum number of entries; `limit` 0 = no maximum.
inline int64_t EntriesLeft(int64_t limit) {
  return limit == 0 ? std::numeric_limits<int64_t>::max() : limit;
}

/// Leaves at most `*left` entries in a part of a list, and counts them down.
template <class Entries>
void CutToLimit(Entries* entries, int64_t* left) {
  const int count = static_cast<int>(std::min<int64_t>(entries->size(), *left));
  entries->DeleteSubrange(count, entries->size() - count);
  *left -= count;
}

/// Calls `fetch(request, &page)` page by page and gives each page to `take`, until the list ends or
/// `limit` entries were read (0 = all). The next_page_token of the last page is set only if entries
/// are left out. `count(page)` is the number of entries of a page. Errors: of both calls.
template <class Reply, class Request, class Count, class Fetch, class Take>
absl::Status ForEachPage(Request request, int64_t limit, const Count& count, const Fetch& fetch,
                         const Take& take) {
  for (int64_t left = EntriesLeft(limit);;) {
    request.set_page_size(static_cast<int32_t>(std::min(left, kPageSizeMax)));
    Reply page;
    DSG_RETURN_IF_ERROR(fetch(request, &page));
    left -= std::invoke(count, page);
    DSG_RETURN_IF_ERROR(take(page));
    if (page.next_page_token().empty() || left <= 0) return absl::OkStatus();
    request.set_page_token(page.next_page_token());
  }
}

/// The same, with all pages in one reply.
template <class Request, class Reply, class Count, class Fetch>
absl::Status FetchPages(const Request& request, int64_t limit, const Count& count,
                        const Fetch& fetch, Reply* all) {
  return ForEachPage<Reply>(request, limit, count, fetch, [all](const Reply& page) {
    all->MergeFrom(page);
    all->set_next_page_token(page.next_page_token());
    return absl::OkStatus();
  });
}

class Session {
 public:
  /// Opens nothing. `notes` takes what is for people only: progress, warnings, questions. It must
  /// outlive this.
  Session(CommonOptions common, std::string program_version, std::ostream* notes)
      : common_(std::move(common)),
        program_version_(std::move(program_version)),
        notes_(*notes),
        times_(map_) {}

  /// Opens the store, or connects to the server. Call it before api().
  /// Errors: as OpenStore and client::Connect.
  absl::Status Open();

  /// Chooses the map: the one named, or the only one there is. Call it before map(), times() and
  /// Begin(). Requires: Open().
  /// Errors: NOT_FOUND/MAP_UNKNOWN; INVALID_ARGUMENT with the names if there are several maps.
  absl::Status ChooseMap();

  query::Api& api() const { return *api_; }
  const CommonOptions& common() const { return common_; }
  /// JSON is what the call answers by itself; a table needs less of each node.
  v1::NodeView ViewFor(v1::NodeView shown) const {
    const bool is_json = common_.json || common_.format == ListFormat::kJsonLines;
    return is_json ? v1::NODE_VIEW_UNSPECIFIED : shown;
  }
  const std::string& program_version() const { return program_version_; }
  const MapSpec& map() const { return map_; }
  const TimeText& times() const { return times_; }
  std::ostream& notes() const { return notes_; }

  /// The answer is "no", which is not an error but has the exit code of NOT_FOUND.
  void set_found(bool found) { found_ = found; }
  bool found() const { return found_; }

  /// Deadline of the next call, from now.
  query::CallContext NewCall() const;

  /// Reads a stream of the api with NewCall(); see query::ReadStream.
  template <class Request, class Reply, class Take>
  absl::Status Read(query::CursorOr<Reply> (query::Api::*method)(const query::CallContext&,
                                                                 const Request&),
                    const Request& request, const Take& take) const {
    const query::CallContext call = NewCall();
    return query::ReadStream(call, (api_.get()->*method)(call, request), take);
  }

  /// Reads all pages of a list, at most `limit` entries (0 = all); see FetchPages.
  template <class Request, class Reply, class Count>
  absl::Status ReadPages(absl::Status (query::Api::*method)(const query::CallContext&,
                                                            const Request&, Reply*),
                         const Request& request, int64_t limit, const Count& count,
                         Reply* all) const {
    const auto fetch = [&](const Request& next, Reply* page) {
      return (api_.get()->*method)(NewCall(), next, page);
    };
    return FetchPages(request, limit, count, fetch, all);
  }

  /// Reads a list and gives each page to `take`; see ForEachPage.
  template <class Request, class Reply, class Count, class Take>
  absl::Status EachPage(absl::Status (query::Api::*method)(const query::CallContext&,
                                                           const Request&, Reply*),
                        const Request& request, int64_t limit, const Count& count,
                        const Take& take) const {
    const auto fetch = [&](const Request& next, Reply* page) {
      return (api_.get()->*method)(NewCall(), next, page);
    };
    return ForEachPage<Reply>(request, limit, count, fetch, take);
  }

  /// A request about the map, at the revision asked for.
  template <class Request>
  Request Begin() const {
    Request request;
    request.set_map(map_.name);
    if (common_.at.number.has_value()) {
      request.mutable_read_at()->set_exact_revision(*common_.at.number);
    } else if (!common_.at.tag.empty()) {
      request.mutable_read_at()->set_tag(common_.at.tag);
    } else if (common_.at.committed_at_ns.has_value()) {
      request.mutable_read_at()->set_committed_at_ns(*common_.at.committed_at_ns);
    }
    return request;
  }

 private:
  CommonOptions common_;
  std::string program_version_;
  std::ostream& notes_;
  std::unique_ptr<query::Api> api_;
  MapSpec map_;
  TimeText times_;
  bool found_ = true;
};

}  // namespace dsg::cli
