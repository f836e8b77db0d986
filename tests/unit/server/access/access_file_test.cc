// SPDX-License-Identifier: Apache-2.0
// Access files: what they give, and how wrong ones are refused.
#include "server/access/access_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "schema/base/status.h"
#include "server/access/access_control.h"
#include "tests/support/temp_folder.h"

namespace dsg::server {
namespace {

using query::Role;

class AccessFileTest : public testing::Test {
 protected:
  std::string Write(const std::string& text, mode_t mode = 0600) {
    const std::string path = folder_.path() + "/access.yaml";
    std::ofstream(path) << text;
    chmod(path.c_str(), mode);
    return path;
  }
  std::string MessageOf(const std::string& text) {
    return std::string(ReadAccessFile(Write(text)).status().message());
  }

  test::TempFolder folder_;
};

const std::string& DigestOfSesame() {
  static const std::string digest = Sha256OfToken("sesame");
  return digest;
}

TEST_F(AccessFileTest, GivesRolesByMap) {
  const auto file =
      ReadAccessFile(Write("callers:\n"
                           "  - name: robot-7\n"
                           "    token_sha256: " +
                           DigestOfSesame() +
                           "\n"
                           "    certificate: robot-7.example.org\n"
                           "    grants:\n"
                           "      - {role: writer, maps: [\"robot-7-*\", hall]}\n"
                           "      - {role: reader, maps: [\"lab-*\"]}\n"
                           "  - {name: operator, uid: 1234, role: admin}\n"));
  ASSERT_TRUE(file.ok()) << file.status();
  const auto found = file->by_token_sha256.find(DigestOfSesame());
  ASSERT_NE(found, file->by_token_sha256.end());
  const Caller& robot = *found->second;
  EXPECT_EQ(robot.name(), "robot-7");
  EXPECT_EQ(robot.RoleIn("robot-7-monday"), Role::kWriter);
  EXPECT_EQ(robot.RoleIn("hall"), Role::kWriter);
  EXPECT_EQ(robot.RoleIn("hallway"), std::nullopt);
  EXPECT_EQ(robot.RoleIn("lab-1"), Role::kReader);
  EXPECT_EQ(robot.HighestRole(), Role::kWriter);
  EXPECT_EQ(file->by_certificate.at("robot-7.example.org"), found->second);
  EXPECT_EQ(file->by_uid.at(1234)->RoleIn("any"), Role::kAdmin);
  EXPECT_TRUE(absl::IsPermissionDenied(robot.Check(Role::kWriter, "lab-1")));
  EXPECT_EQ(ReasonOf(robot.Check(Role::kReader, "secret")), Reason::kMapUnknown);
}

TEST_F(AccessFileTest, SaysWhatIsWrongAndWhere) {
  const std::string token = "    token_sha256: " + DigestOfSesame() + "\n";
  const struct {
    std::string text;
    std::string words;
  } cases[] = {
      {"[1, 2", "access.yaml:1:"},
      {"", "begin with \"callers:\""},
      {"callers: []\n", "nobody could call"},
      {"people:\n  - name: a\n", "unknown key \"people\""},
      {"callers:\n  - name: a\n" + token, "there is no role"},
      {"callers:\n  - name: a\n    role: reader\n", "has nothing to show"},
      {"callers:\n  - name: a\n    role: king\n" + token,
       "give reader, writer, maintainer or admin"},
      {"callers:\n  - name: a b\n    role: reader\n" + token, "letters, digits"},
      {"callers:\n  - name: a\n    role: reader\n    uid: -1\n", "no number of a user"},
      {"callers:\n  - name: a\n    role: reader\n    uid: 4294967295\n", "no number of a user"},
      {"callers:\n  - name: a\n    role: reader\n    token_sha256: sesame\n", "--new-token"},
      {"callers:\n  - name: a\n    role: reader\n    token_sha256: " + Sha256OfToken("") + "\n",
       "no token at all"},
      {"callers:\n  - name: keeper\n    role: reader\n" + token, "is taken"},
      {"callers:\n  - name: a\n    role: reader\n    maps: []\n" + token, "maps is empty"},
      {"callers:\n  - name: a\n    role: reader\n    maps: [\"../x\"]\n" + token, "\"../x\""},
      {"callers:\n  - name: a\n    role: reader\n    maps: [\"a*b\"]\n" + token, "\"a*b\""},
      {"callers:\n  - name: a\n    role: reader\n    grants: [{role: admin}]\n" + token,
       "beside role or maps"},
      {"callers:\n  - {name: a, role: reader, uid: 5}\n  - {name: b, role: admin, uid: 5}\n",
       "\"a\" and \"b\" have the same uid"},
      {"callers:\n  - {name: a, role: reader, uid: 5, shoe_size: 43}\n", "shoe_size"},
  };
  for (const auto& one : cases) {
    const std::string message = MessageOf(one.text);
    EXPECT_NE(message.find(one.words), std::string::npos) << one.text << "\n" << message;
  }
  // The line is that of the entry.
  EXPECT_NE(MessageOf("callers:\n  - {name: a, uid: 1, role: reader}\n  - {name: b, uid: x, role: "
                      "reader}\n")
                .find("access.yaml:3:"),
            std::string::npos);
}

TEST_F(AccessFileTest, AFileThatOthersCanChangeIsRefused) {
  const std::string text = "callers:\n  - {name: a, uid: 5, role: reader}\n";
  EXPECT_TRUE(ReadAccessFile(Write(text, 0644)).ok());
  const absl::Status status = ReadAccessFile(Write(text, 0664)).status();
  EXPECT_NE(status.message().find("chmod go-w"), std::string::npos) << status;
  EXPECT_FALSE(ReadAccessFile(folder_.path() + "/none.yaml").ok());
  EXPECT_FALSE(ReadAccessFile(folder_.path()).ok());
}

TEST_F(AccessFileTest, ATokenGoesBeforeWhatTheConnectionShows) {
  const std::string path = Write(
      "callers:\n"
      "  - {name: tokened, role: reader, token_sha256: " +
      DigestOfSesame() +
      "}\n"
      "  - {name: certified, role: reader, certificate: robot}\n"
      "  - {name: user, role: reader, uid: 1234}\n");
  const auto control = AccessControl::Open(path);
  ASSERT_TRUE(control.ok()) << control.status();
  const auto name_of = [&](const Peer& peer,
                           std::optional<std::string_view> authorization) -> std::string {
    const auto caller = (*control)->Identify(peer, authorization);
    EXPECT_TRUE(caller.ok() || absl::IsUnauthenticated(caller.status())) << caller.status();
    return caller.ok() ? caller->caller->name() : "";
  };
  EXPECT_EQ(name_of({1234, "robot"}, "Bearer sesame"), "tokened");
  EXPECT_EQ(name_of({1234, "robot"}, std::nullopt), "certified");
  EXPECT_EQ(name_of({1234, ""}, std::nullopt), "user");
  // A wrong token is not passed over.
  for (const char* wrong : {"", "Bearer sesam", "Bearer ", "sesame", "Basic sesame"}) {
    EXPECT_EQ(name_of({1234, "robot"}, wrong), "") << wrong;
  }
  EXPECT_EQ(name_of({std::nullopt, "other"}, std::nullopt), "");
  EXPECT_EQ(name_of({}, std::nullopt), "");
  EXPECT_EQ(name_of({geteuid(), ""}, std::nullopt), "keeper");
}

TEST_F(AccessFileTest, AWrongFileLeavesTheOldOneInForce) {
  const std::string path = Write("callers:\n  - {name: user, role: reader, uid: 1234}\n");
  const auto control = AccessControl::Open(path);
  ASSERT_TRUE(control.ok()) << control.status();
  Write("callers:\n  - {name: other, role: king, uid: 1234}\n");
  EXPECT_FALSE((*control)->Reload().ok());
  EXPECT_EQ((*control)->Identify({1234, ""}, std::nullopt)->caller->name(), "user");
  Write("callers:\n  - {name: other, role: admin, uid: 1234}\n");
  const KnownCaller before = *(*control)->Identify({1234, ""}, std::nullopt);
  EXPECT_EQ(before.generation, (*control)->generation());
  EXPECT_TRUE((*control)->Reload().ok());
  EXPECT_NE(before.generation, (*control)->generation());
  EXPECT_EQ((*control)->Identify({1234, ""}, std::nullopt)->caller->name(), "other");
}

TEST(AccessControl, WithoutAFileEverybodyMayDoEverything) {
  const auto control = AccessControl::Open("");
  ASSERT_TRUE(control.ok());
  EXPECT_EQ((*control)->Identify({}, "Bearer wrong")->caller->RoleIn("any"), Role::kAdmin);
  EXPECT_FALSE((*control)->asks_who());
}

}  // namespace
}  // namespace dsg::server
