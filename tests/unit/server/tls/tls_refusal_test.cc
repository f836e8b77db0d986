// SPDX-License-Identifier: Apache-2.0
// Who gets no plain socket, and that they cost nothing.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "tests/unit/server/tls/tls_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

class TlsRefusal : public ::testing::Test {
 protected:
  // Connects, and lets the terminator have the other end.
  int Connect(TlsTerminator* terminator, const std::shared_ptr<const TlsContext>& context) {
    const TcpPair pair = ConnectTcp();
    terminator->Accept(pair.server, context, "test peer", plain_.take());
    return pair.client;
  }

  // True if the client gets an answer through the terminator.
  bool IsServed(TlsTerminator* terminator, const std::shared_ptr<const TlsContext>& context,
                const ClientOptions& options) {
    TlsClient client(Connect(terminator, context), options);
    const bool is_served = client.Connect() && client.Write("ping") && client.Read(4) == "ping";
    client.Drop(false);
    EXPECT_TRUE(WaitUntil([&] { return terminator->open_count() == 0; }));
    return is_served;
  }

  // True when the other side closes within ten seconds; reads what it still says.
  static bool IsClosed(int fd) {
    std::array<char, 1000> bytes;
    while (true) {
      const ssize_t got = recv(fd, bytes.data(), bytes.size(), 0);
      if (got <= 0) return got == 0 || errno == ECONNRESET;
    }
  }

  const TlsFolder folder_;
  PlainServer plain_{Echo};
};

TEST_F(TlsRefusal, OfOldVersions) {
  const auto terminator = StartTerminator();
  const auto context = folder_.Load(false);
  EXPECT_FALSE(IsServed(terminator.get(), context, {.version_max = TLS1_VERSION}));
  EXPECT_FALSE(IsServed(terminator.get(), context, {.version_max = TLS1_1_VERSION}));
  EXPECT_EQ(plain_.taken_count(), 0);
  EXPECT_TRUE(IsServed(terminator.get(), context, {.version_max = TLS1_2_VERSION}));
  EXPECT_TRUE(IsServed(terminator.get(), context, {.version_max = TLS1_3_VERSION}));
  EXPECT_EQ(plain_.taken_count(), 2);
}

TEST_F(TlsRefusal, OfClientsWithoutAValidCertificate) {
  const auto terminator = StartTerminator();
  const auto context = folder_.Load(true);
  const Identity other_ca = MakeIdentity({.common_name = "test CA", .is_ca = true}, nullptr);
  const Identity stranger = MakeIdentity({.common_name = "robot"}, &other_ca);
  const Identity self_signed = MakeIdentity({.common_name = "robot"}, nullptr);
  const Identity expired =
      folder_.Client({.common_name = "robot", .begins_s = -7200, .ends_s = -60});
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION}) {
    for (const Identity* identity :
         {static_cast<const Identity*>(nullptr), &stranger, &self_signed, &expired}) {
      EXPECT_FALSE(
          IsServed(terminator.get(), context, {.identity = identity, .version_max = version}));
    }
  }
  EXPECT_EQ(plain_.taken_count(), 0);
  const Identity robot = folder_.Client({.common_name = "robot"});
  EXPECT_TRUE(IsServed(terminator.get(), context, {.identity = &robot}));
  EXPECT_EQ(plain_.taken_count(), 1);
}

TEST_F(TlsRefusal, SaysWhichClientItKnows) {
  const auto terminator = StartTerminator();
  const auto context = folder_.Load(true);
  const Identity by_san =
      folder_.Client({.common_name = "cn", .alternative_names = "DNS:robot-7.example"});
  EXPECT_TRUE(IsServed(terminator.get(), context, {.identity = &by_san}));
  EXPECT_EQ(plain_.last_client(), "robot-7.example");
  const Identity by_cn = folder_.Client({.common_name = "robot 8"});
  EXPECT_TRUE(IsServed(terminator.get(), context, {.identity = &by_cn}));
  EXPECT_EQ(plain_.last_client(), "robot 8");
  // Asked for none, so it tells none.
  EXPECT_TRUE(IsServed(terminator.get(), folder_.Load(false), {.identity = &by_cn}));
  EXPECT_EQ(plain_.last_client(), "");
}

TEST_F(TlsRefusal, OfOtherProtocolsByAlpn) {
  const auto terminator = StartTerminator();
  const auto context = folder_.Load(false, "h2");
  TlsClient client(Connect(terminator.get(), context), {.protocol = "h2"});
  EXPECT_TRUE(client.Connect());
  EXPECT_EQ(client.Protocol(), "h2");
  client.Drop(false);
  EXPECT_FALSE(IsServed(terminator.get(), context, {.protocol = "http/1.1"}));
  EXPECT_TRUE(IsServed(terminator.get(), context, {}));
}

TEST_F(TlsRefusal, OfPlainTextAndGarbage) {
  const auto terminator = StartTerminator();
  const auto context = folder_.Load(true);
  for (const std::string& text :
       {std::string("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"),
        std::string("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"), RandomBytes(100'000, 7)}) {
    const int fd = Connect(terminator.get(), context);
    EXPECT_GT(send(fd, text.data(), text.size(), MSG_NOSIGNAL), 0);
    EXPECT_TRUE(IsClosed(fd));
    close(fd);
  }
  EXPECT_TRUE(WaitUntil([&] { return terminator->open_count() == 0; }));
  EXPECT_EQ(plain_.taken_count(), 0);
}

TEST_F(TlsRefusal, OfHandshakesThatStall) {
  const auto terminator = StartTerminator({.handshake_time_max = milliseconds(200)});
  const auto begin = Clock::now();
  const int silent = Connect(terminator.get(), folder_.Load(false));
  const int slow = Connect(terminator.get(), folder_.Load(false));
  // The head of a record that never comes.
  const unsigned char head[] = {0x16, 0x03, 0x01, 0x02, 0x00, 0x01};
  EXPECT_EQ(send(slow, head, sizeof(head), 0), static_cast<ssize_t>(sizeof(head)));
  EXPECT_TRUE(IsClosed(silent));
  EXPECT_TRUE(IsClosed(slow));
  EXPECT_GE(Clock::now() - begin, milliseconds(200));
  EXPECT_LT(Clock::now() - begin, milliseconds(2000));
  EXPECT_TRUE(WaitUntil([&] { return terminator->handshake_count() == 0; }));
  EXPECT_EQ(plain_.taken_count(), 0);
  close(silent);
  close(slow);
}

TEST_F(TlsRefusal, OfMoreHandshakesThanAllowed) {
  const auto terminator = StartTerminator({.handshake_max = 3});
  const auto context = folder_.Load(false);
  std::array<int, 3> waiting;
  for (int& fd : waiting) fd = Connect(terminator.get(), context);
  const int fd = Connect(terminator.get(), context);
  EXPECT_TRUE(IsClosed(fd));
  close(fd);
  EXPECT_EQ(terminator->handshake_count(), 3);
  // One that goes makes room.
  close(waiting.back());
  EXPECT_TRUE(WaitUntil([&] { return terminator->handshake_count() == 2; }));
  TlsClient client(Connect(terminator.get(), context), {});
  EXPECT_TRUE(client.Connect());
  EXPECT_TRUE(client.Write("ping"));
  EXPECT_EQ(client.Read(4), "ping");
  EXPECT_EQ(terminator->handshake_count(), 2);
  close(waiting[0]);
  close(waiting[1]);
}

TEST_F(TlsRefusal, OfMoreConnectionsThanAllowed) {
  const auto terminator = StartTerminator({.connection_max = 1});
  TlsClient client(Connect(terminator.get(), folder_.Load(false)), {});
  EXPECT_TRUE(client.Connect());
  const int fd = Connect(terminator.get(), folder_.Load(false));
  EXPECT_TRUE(IsClosed(fd));
  close(fd);
}

TEST_F(TlsRefusal, AFloodOfThemIsOneLineASecond) {
  const auto terminator = StartTerminator();
  const auto context = folder_.Load(false);
  ::testing::internal::CaptureStderr();
  const auto begin = Clock::now();
  for (int i = 0; i < 100; ++i) {
    const int fd = Connect(terminator.get(), context);
    EXPECT_EQ(send(fd, "GET / HTTP/1.1\r\n\r\n", 18, MSG_NOSIGNAL), 18);
    IsClosed(fd);
    close(fd);
  }
  const auto took = std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - begin);
  const std::string log = ::testing::internal::GetCapturedStderr();
  const auto lines = std::count(log.begin(), log.end(), '\n');
  EXPECT_GE(lines, 1);
  EXPECT_LE(lines, 1 + took.count());
  EXPECT_NE(log.find("TLS handshake failed peer=\"test peer\" why=\"http request\" left_out=0"),
            std::string::npos)
      << log;
}

// Load balancers see whether somebody listens.
TEST_F(TlsRefusal, SaysNothingOfClientsThatOnlyConnect) {
  const auto terminator = StartTerminator();
  ::testing::internal::CaptureStderr();
  close(Connect(terminator.get(), folder_.Load(false)));
  EXPECT_TRUE(WaitUntil([&] { return terminator->open_count() == 0; }));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST_F(TlsRefusal, WithoutDescriptorsForThePair) {
  const auto terminator = StartTerminator();
  const auto context = folder_.Load(false);
  TlsClient client(Connect(terminator.get(), context), {});
  EXPECT_TRUE(WaitUntil([&] { return terminator->handshake_count() == 1; }));
  ::testing::internal::CaptureStderr();
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const int lowest_free = dup(0);
  close(lowest_free);
  const rlimit none{static_cast<rlim_t>(lowest_free), before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  client.Connect();
  EXPECT_EQ(client.ReadSome(), "");
  setrlimit(RLIMIT_NOFILE, &before);
  const std::string log = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(log.find("no socket for a TLS connection peer=\"test peer\""), std::string::npos)
      << log;
  EXPECT_TRUE(WaitUntil([&] { return terminator->open_count() == 0; }));
  EXPECT_EQ(plain_.taken_count(), 0);
  EXPECT_TRUE(IsServed(terminator.get(), context, {}));
}

}  // namespace
}  // namespace dsg::server
