// SPDX-License-Identifier: Apache-2.0
// Which calls get a line, and that nothing is changed that no line can tell.
#include "server/access/call_audit.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <filesystem>
#include <vector>

#include "query/api/api.h"
#include "tests/support/temp_folder.h"

namespace dsg::server {
namespace {

namespace methods = query::methods;

class CallAuditTest : public testing::Test {
 protected:
  CallAuditTest() : audit_(*AuditLog::Open(path_, "")) {}

  static AuditedCall Call(const query::MethodInfo& method) {
    return {&method, "robot-7", "unix:", "hall"};
  }
  std::vector<AuditEntry> Entries() const {
    std::vector<AuditEntry> entries;
    EXPECT_TRUE(
        VerifyAuditLog(path_, "", [&](const AuditEntry& entry) { entries.push_back(entry); }).ok());
    return entries;
  }

  test::TempFolder folder_;
  const std::string path_ = folder_.path() + "/audit.jsonl";
  CallAudit audit_;
};

TEST_F(CallAuditTest, TellsWhatChangesAndWhoWasRefusedAndNoQuestions) {
  const absl::Status denied = absl::PermissionDeniedError("no");
  for (const query::MethodInfo& method : {methods::kGetNode, methods::kCommit, methods::kPrune}) {
    ASSERT_TRUE(audit_.Begin(Call(method)).ok());
    audit_.End(Call(method), absl::OkStatus(), 5);
  }
  audit_.End(Call(methods::kGetNode), denied, 0);
  audit_.End(Call(methods::kGetNode), absl::NotFoundError("no"), 0);
  std::vector<std::string> told;
  for (const AuditEntry& entry : Entries()) told.push_back(entry.method + " " + entry.code);
  EXPECT_EQ(told, (std::vector<std::string>{"Commit BEGUN", "Commit OK", "Prune BEGUN", "Prune OK",
                                            "GetNode PERMISSION_DENIED"}));
  // Of a map that its caller must not know of.
  AuditedCall hidden = Call(methods::kGetNode);
  hidden.is_refused = true;
  audit_.End(hidden, absl::NotFoundError("no"), 0);
  EXPECT_EQ(Entries().back().code, "NOT_FOUND");
}

TEST_F(CallAuditTest, AFloodOfRefusedCallsFillsNoDisk) {
  for (int i = 0; i < 5000; ++i) {
    audit_.End(Call(methods::kListMaps), absl::UnauthenticatedError("who"), 0);
  }
  audit_.End(Call(methods::kCommit), absl::OkStatus(), 1);
  const std::vector<AuditEntry> entries = Entries();
  EXPECT_GE(entries.size(), 100u);
  EXPECT_LT(entries.size(), 300u);
  // Each of the 5000 has a line or is counted in one.
  int64_t count = static_cast<int64_t>(entries.size()) - 1;
  for (const AuditEntry& entry : entries) count += entry.left_out_count;
  EXPECT_EQ(count, 5000);
  EXPECT_GT(entries.back().left_out_count, 0);
}

TEST_F(CallAuditTest, NothingIsChangedWhileTheLogCannotBeWritten) {
  audit_.End(Call(methods::kCommit), absl::OkStatus(), 1);
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit full = before;
  // In the middle of the next line.
  full.rlim_cur = std::filesystem::file_size(path_) + 20;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  const absl::Status commit = audit_.Begin(Call(methods::kCommit));
  const absl::Status prune = audit_.Begin(Call(methods::kPrune));
  const absl::Status question = audit_.Begin(Call(methods::kGetNode));
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_FALSE(commit.ok());
  EXPECT_FALSE(prune.ok());
  EXPECT_TRUE(question.ok()) << question;
  // Nothing of the lines that failed is left.
  EXPECT_EQ(Entries().size(), 1u);
  EXPECT_TRUE(audit_.Begin(Call(methods::kCommit)).ok());
  EXPECT_EQ(Entries().back().code, "BEGUN");
}

TEST_F(CallAuditTest, ALogThatWasMovedIsBegunAnewWhenItIsAskedFor) {
  const auto audit = CallAudit::Open(folder_.path() + "/moving.jsonl", "");
  ASSERT_TRUE(audit.ok()) << audit.status();
  ASSERT_TRUE((*audit)->Begin(Call(methods::kPrune)).ok());
  std::filesystem::rename(folder_.path() + "/moving.jsonl", folder_.path() + "/moved.jsonl");
  const absl::Status status = (*audit)->Begin(Call(methods::kPrune));
  EXPECT_NE(status.message().find("SIGHUP"), std::string::npos) << status;
  ASSERT_TRUE((*audit)->Reload().ok());
  EXPECT_TRUE((*audit)->Begin(Call(methods::kPrune)).ok());
  for (const char* name : {"/moving.jsonl", "/moved.jsonl"}) {
    const auto head = VerifyAuditLog(folder_.path() + name, "");
    ASSERT_TRUE(head.ok()) << head.status();
    EXPECT_EQ(head->entry_count, 1);
  }
}

TEST(CallAudit, WithoutALogNothingIsWritten) {
  CallAudit audit(nullptr);
  const AuditedCall call{&methods::kPrune, "", "", ""};
  EXPECT_TRUE(audit.Begin(call).ok());
  audit.End(call, absl::OkStatus(), 1);
}

}  // namespace
}  // namespace dsg::server
