// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "schema/base/status.h"
#include "server/listen.h"
#include "server/server.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::server {
namespace {

TEST(ListenAddress, ReadsSocketsHostsAndPorts) {
  for (const char* text : {"unix:/run/dsg.sock", "unix:relative", "127.0.0.1:4410", "localhost:0",
                           "[::1]:65535", "127.9.9.9:1"}) {
    const auto address = ParseListenAddress(text, false);
    ASSERT_TRUE(address.ok()) << address.status();
    EXPECT_EQ(address->ToString(), text);
    EXPECT_TRUE(address->is_local()) << text;
  }
}

TEST(ListenAddress, RefusesWhatOtherMachinesReachUnlessTold) {
  for (const char* text : {"0.0.0.0:1", "192.168.1.5:4410", "[::]:1", "example.org:80"}) {
    const auto address = ParseListenAddress(text, false);
    EXPECT_EQ(ReasonOf(address.status()), Reason::kFieldInvalid);
    EXPECT_NE(address.status().message().find("--allow-remote"), absl::string_view::npos);
    const auto remote = ParseListenAddress(text, true);
    ASSERT_TRUE(remote.ok()) << text;
    EXPECT_FALSE(remote->is_local()) << text;
  }
}

TEST(ListenAddress, RefusesOtherForms) {
  const std::string long_path = "unix:/" + std::string(200, 'x');
  for (const std::string text : {"", "unix:", "localhost", ":80", "localhost:", "localhost:70000",
                                 "localhost:-1", "localhost:http", long_path.c_str()}) {
    EXPECT_EQ(ReasonOf(ParseListenAddress(text, true).status()), Reason::kFieldInvalid) << text;
  }
}

class Listen : public testing::Test {
 protected:
  Listen() { test::MakeOffice(folder_.path()); }

  absl::StatusOr<std::unique_ptr<Server>> Start(const std::string& listen) {
    ServerOptions options;
    options.listen = listen;
    options.worker_count = 1;
    return Server::Start(test::OpenCore(folder_.path()), options);
  }

  std::string SocketPath() const { return folder_.path() + "/server.sock"; }

  test::TempFolder folder_;
};

TEST_F(Listen, RefusesASecondServerOnTheSameSocketWhichLeavesTheFirstAlone) {
  const auto first = Start("unix:" + SocketPath());
  ASSERT_TRUE(first.ok()) << first.status();
  const auto second = Start("unix:" + SocketPath());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_NE(second.status().message().find(SocketPath()), absl::string_view::npos);
  EXPECT_TRUE(std::filesystem::exists(SocketPath()));
}

TEST_F(Listen, RefusesASecondServerOnTheSamePortNamingTheReason) {
  const auto first = Start("127.0.0.1:0");
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_NE((*first)->address(), "127.0.0.1:0");
  const auto second = Start((*first)->address());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_NE(second.status().message().find((*first)->address()), absl::string_view::npos);
  EXPECT_NE(second.status().message().find("in use"), absl::string_view::npos) << second.status();
}

TEST_F(Listen, MakesTheSocketForItsUserOnly) {
  const auto server = Start("unix:" + SocketPath());
  ASSERT_TRUE(server.ok()) << server.status();
  struct stat found {};
  ASSERT_EQ(lstat(SocketPath().c_str(), &found), 0);
  EXPECT_TRUE(S_ISSOCK(found.st_mode));
  EXPECT_EQ(found.st_mode & 0777, 0600u);
}

TEST_F(Listen, TakesThePlaceOfADeadServersSocket) {
  const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  SocketPath().copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  close(fd);
  ASSERT_TRUE(std::filesystem::exists(SocketPath()));
  const auto server = Start("unix:" + SocketPath());
  EXPECT_TRUE(server.ok()) << server.status();
}

TEST_F(Listen, RefusesASocketThatSomebodyElseAnswersOn) {
  const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  SocketPath().copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(listen(fd, 1), 0);
  EXPECT_EQ(ReasonOf(UnixSocketClaim::Take(SocketPath()).status()), Reason::kWriterLocked);
  EXPECT_TRUE(std::filesystem::exists(SocketPath()));
  close(fd);
}

TEST_F(Listen, NeverRemovesAFileThatIsNoSocket) {
  std::ofstream(SocketPath()) << "precious";
  EXPECT_EQ(ReasonOf(Start("unix:" + SocketPath()).status()), Reason::kFieldInvalid);
  EXPECT_EQ(std::filesystem::file_size(SocketPath()), 8u);
}

TEST_F(Listen, NamesTheFolderThatIsMissing) {
  const auto server = Start("unix:" + folder_.path() + "/none/server.sock");
  ASSERT_FALSE(server.ok());
  EXPECT_NE(server.status().message().find("No such file"), absl::string_view::npos);
}

TEST_F(Listen, CanListenAgainAtOnceAfterAStop) {
  for (int i = 0; i < 3; ++i) {
    const auto server = Start("unix:" + SocketPath());
    ASSERT_TRUE(server.ok()) << server.status();
    (*server)->Shutdown(std::chrono::milliseconds(100));
  }
}

}  // namespace
}  // namespace dsg::server
