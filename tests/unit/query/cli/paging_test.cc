// SPDX-License-Identifier: Apache-2.0
#include "query/cli/session.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "dsg/v1/query_service.pb.h"

namespace dsg::cli {
namespace {

// A listing of `total` nodes in pages, written down call by call.
class Listing {
 public:
  explicit Listing(int total) : total_(total) {}

  absl::Status Fetch(const v1::ListNodesRequest& request, v1::ListNodesResponse* reply) {
    page_sizes.push_back(request.page_size());
    int next = request.page_token().empty() ? 0 : std::stoi(request.page_token());
    for (int i = 0; i < request.page_size() && next < total_; ++i) {
      reply->add_nodes()->set_id("p" + std::to_string(next++));
    }
    if (next < total_) reply->set_next_page_token(std::to_string(next));
    reply->mutable_header()->set_read_revision(3);
    return absl::OkStatus();
  }

  v1::ListNodesResponse All(int64_t limit) {
    v1::ListNodesResponse all;
    const absl::Status status = FetchPages(
        v1::ListNodesRequest(), limit,
        [](const v1::ListNodesResponse& page) { return page.nodes_size(); },
        [this](const v1::ListNodesRequest& request, v1::ListNodesResponse* page) {
          return Fetch(request, page);
        },
        &all);
    EXPECT_TRUE(status.ok()) << status;
    return all;
  }

  std::vector<int> page_sizes;

 private:
  int total_;
};

TEST(Paging, JoinsAllPagesInOrder) {
  Listing listing(2500);
  const v1::ListNodesResponse all = listing.All(0);
  ASSERT_EQ(all.nodes_size(), 2500);
  EXPECT_EQ(all.nodes(2499).id(), "p2499");
  EXPECT_EQ(all.next_page_token(), "");
  EXPECT_EQ(all.header().read_revision(), 3);
  EXPECT_EQ(listing.page_sizes, (std::vector<int>{1000, 1000, 1000}));
}

TEST(Paging, StopsAtTheLimitAndSaysThatThereIsMore) {
  Listing listing(2500);
  const v1::ListNodesResponse some = listing.All(1200);
  EXPECT_EQ(some.nodes_size(), 1200);
  EXPECT_NE(some.next_page_token(), "");
  EXPECT_EQ(listing.page_sizes, (std::vector<int>{1000, 200}));
}

TEST(Paging, LimitThatEndsWithTheListingLeavesNothing) {
  Listing listing(5);
  EXPECT_EQ(listing.All(5).next_page_token(), "");
}

TEST(Paging, PassesErrorsOn) {
  v1::ListNodesResponse all;
  EXPECT_EQ(FetchPages(
                v1::ListNodesRequest(), 0, [](const v1::ListNodesResponse&) { return 0; },
                [](const v1::ListNodesRequest&, v1::ListNodesResponse*) {
                  return absl::NotFoundError("m");
                },
                &all),
            absl::NotFoundError("m"));
}

}  // namespace
}  // namespace dsg::cli
