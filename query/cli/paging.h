// SPDX-License-Identifier: Apache-2.0
// Turns a paged listing into one reply.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>

#include "absl/status/status.h"
#include "schema/base/status.h"

namespace dsg::cli {

/// Largest page that the services give.
inline constexpr int64_t kPageSizeMax = 1000;

/// How many entries may still be listed: `limit`, where 0 stands for all.
inline int64_t EntriesLeft(int64_t limit) {
  return limit == 0 ? std::numeric_limits<int64_t>::max() : limit;
}

/// Calls `fetch(request, &page)` page by page, until the listing ends or `limit` entries (0 = all)
/// are in `all`. Then `all`'s next_page_token is set only if entries were left out.
/// `count(page)` says how many entries a page has.
template <class Request, class Reply, class Count, class Fetch>
absl::Status FetchPages(Request request, int64_t limit, const Count& count, const Fetch& fetch,
                        Reply* all) {
  for (int64_t left = EntriesLeft(limit);;) {
    request.set_page_size(static_cast<int32_t>(std::min(left, kPageSizeMax)));
    Reply page;
    DSG_RETURN_IF_ERROR(fetch(request, &page));
    const std::string token = page.next_page_token();
    left -= count(page);
    all->MergeFrom(page);
    all->set_next_page_token(token);
    if (token.empty() || left <= 0) return absl::OkStatus();
    request.set_page_token(token);
  }
}

}  // namespace dsg::cli
