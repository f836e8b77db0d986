// SPDX-License-Identifier: Apache-2.0
// What goes through the terminator, and how it ends.
#include "server/tls/tls_terminator.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <iostream>
#include <random>

#include "tests/unit/server/tls/tls_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

class Terminator : public ::testing::Test {
 protected:
  std::unique_ptr<TlsClient> Connect(PlainServer* plain, const ClientOptions& options = {},
                                     int buffer_bytes = 0) {
    const TcpPair pair = ConnectTcp(buffer_bytes);
    terminator_->Accept(pair.server, context_, "test peer", plain->take());
    auto client = std::make_unique<TlsClient>(pair.client, options);
    EXPECT_TRUE(client->Connect());
    return client;
  }

  bool IsAllClosed() const {
    return WaitUntil([&] { return terminator_->open_count() == 0; });
  }

  static bool Echoes(TlsClient* client, const std::string& bytes) {
    return client->Write(bytes) && client->Read(bytes.size()) == bytes;
  }

  const TlsFolder folder_;
  std::shared_ptr<const TlsContext> context_ = folder_.Load(false);
  std::unique_ptr<TlsTerminator> terminator_ = StartTerminator();
};

TEST_F(Terminator, PassesBytesOnInBothDirections) {
  const uint64_t seed = test::TestSeed(1);
  PlainServer plain(Echo);
  const Identity& ca = folder_.ca();
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION}) {
    for (const size_t size : {size_t{1}, size_t{100'000}, size_t{20'000'000}}) {
      const auto client = Connect(&plain, {.ca = &ca, .version_max = version});
      EXPECT_EQ(client->ServerCommonName(), "server one");
      const std::string bytes = RandomBytes(size, seed + size);
      const auto begin = Clock::now();
      const std::string back = client->Exchange(bytes, 100'000, seed);
      const double s = std::chrono::duration<double>(Clock::now() - begin).count();
      EXPECT_TRUE(back == bytes) << back.size() << " of " << size << " bytes, seed " << seed;
      std::cout << (version == TLS1_3_VERSION ? "TLS 1.3: " : "TLS 1.2: ") << size
                << " bytes there and back in " << s * 1e3 << " ms, "
                << static_cast<double>(size) / s / 1e6 << " MB/s each way\n";
    }
  }
}

TEST_F(Terminator, PassesManySmallRecordsOn) {
  PlainServer plain(Echo);
  const auto client = Connect(&plain);
  const std::string bytes = RandomBytes(100'000, 1);
  EXPECT_TRUE(client->Exchange(bytes, 3, 1) == bytes);
}

TEST_F(Terminator, PassesAStreamOnInOneDirection) {
  constexpr size_t kSize = 100'000'000;
  PlainServer plain([](int fd) {
    const std::string chunk(1'000'000, 'x');
    for (size_t sent = 0; sent < kSize; sent += chunk.size()) WritePlain(fd, chunk);
  });
  const auto client = Connect(&plain);
  const auto begin = Clock::now();
  size_t got = 0;
  while (true) {
    const size_t more = client->ReadSome().size();
    if (more == 0) break;
    got += more;
  }
  const double s = std::chrono::duration<double>(Clock::now() - begin).count();
  EXPECT_EQ(got, kSize);
  EXPECT_TRUE(client->IsEndClean());
  std::cout << static_cast<double>(kSize) / s / 1e6 << " MB/s to the client\n";
}

TEST_F(Terminator, ManyThreadsServeManyConnections) {
  terminator_ = StartTerminator({.thread_count = 3});
  PlainServer plain(Echo);
  std::array<std::thread, 12> threads;
  std::atomic<int> good_count{0};
  for (std::thread& thread : threads) {
    thread = std::thread([&] {
      const auto client = Connect(&plain);
      if (Echoes(client.get(), RandomBytes(50'000, 1))) ++good_count;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(good_count, 12);
  EXPECT_TRUE(IsAllClosed());
}

// Sends until the sockets are full for 300 ms. Returns how much went.
size_t FillPlain(int fd) {
  fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
  const std::string chunk(10'000, 'x');
  size_t sent = 0;
  for (auto last = Clock::now(); Clock::now() - last < milliseconds(300);) {
    const ssize_t put = send(fd, chunk.data(), chunk.size(), MSG_NOSIGNAL);
    if (put > 0) {
      sent += static_cast<size_t>(put);
      last = Clock::now();
    } else {
      std::this_thread::sleep_for(milliseconds(5));
    }
  }
  return sent;
}

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) / 1e6;
}

TEST_F(Terminator, AStalledReaderStallsItsWriterAndNobodyElse) {
  std::atomic<size_t> sent{0};
  std::atomic<bool> is_full{false};
  std::atomic<bool> may_end{false};
  PlainServer source([&](int fd) {
    sent = FillPlain(fd);
    is_full = true;
    WaitUntil([&] { return may_end.load(); });
  });
  PlainServer plain(Echo);
  const auto stalled = Connect(&source, {}, 50'000);
  EXPECT_TRUE(WaitUntil([&] { return is_full.load(); }));
  // The sockets hold about 200 kB each.
  EXPECT_LT(sent, 1'500'000u);
  std::cout << "a writer stalls after " << sent << " bytes\n";
  const auto other = Connect(&plain);
  EXPECT_TRUE(Echoes(other.get(), RandomBytes(60'000, 1)));
  // No busy loop while it is full.
  const double before = CpuSeconds();
  std::this_thread::sleep_for(milliseconds(500));
  EXPECT_LT(CpuSeconds() - before, 0.1);
  // All of it arrives in the end.
  may_end = true;
  EXPECT_EQ(stalled->ReadAll().size(), sent);
  EXPECT_TRUE(stalled->IsEndClean());
}

TEST_F(Terminator, AStalledPlainSideStallsItsClient) {
  std::atomic<bool> may_read{false};
  std::atomic<size_t> got{0};
  PlainServer sink([&](int fd) {
    WaitUntil([&] { return may_read.load(); });
    got = ReadPlain(fd).size();
  });
  const auto client = Connect(&sink, {}, 50'000);
  const timeval patience{0, 300'000};
  setsockopt(client->fd(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
  const std::string chunk(10'000, 'x');
  size_t sent = 0;
  while (sent < 20'000'000 && client->Write(chunk)) sent += chunk.size();
  EXPECT_LT(sent, 1'500'000u);
  std::cout << "a client stalls after " << sent << " bytes\n";
  may_read = true;
  client->Drop(false);
  EXPECT_TRUE(IsAllClosed());
  // What was whole when it went has arrived.
  EXPECT_TRUE(WaitUntil([&] { return got >= sent; })) << got << " of " << sent;
}

TEST_F(Terminator, AClientMayEndItsDirectionFirst) {
  const std::string question = RandomBytes(300'000, 1);
  const std::string answer = RandomBytes(1'000'000, 2);
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION}) {
    std::string asked;
    {
      PlainServer plain([&](int fd) {
        asked = ReadPlain(fd);
        WritePlain(fd, answer);
      });
      const auto client = Connect(&plain, {.version_max = version});
      EXPECT_TRUE(client->Write(question));
      client->EndWriting();
      EXPECT_TRUE(client->ReadAll() == answer);
      EXPECT_TRUE(client->IsEndClean());
      EXPECT_TRUE(IsAllClosed());
    }
    EXPECT_TRUE(asked == question);
  }
}

TEST_F(Terminator, ThePlainSideMayEndItsDirectionFirst) {
  const std::string greeting = RandomBytes(100'000, 1);
  const std::string rest = RandomBytes(1'000'000, 2);
  std::string got;
  {
    PlainServer plain([&](int fd) {
      WritePlain(fd, greeting);
      shutdown(fd, SHUT_WR);
      got = ReadPlain(fd);
    });
    const auto client = Connect(&plain);
    EXPECT_TRUE(client->ReadAll() == greeting);
    EXPECT_TRUE(client->IsEndClean());
    EXPECT_TRUE(client->Write(rest));
    client->EndWriting();
    EXPECT_TRUE(IsAllClosed());
  }
  EXPECT_TRUE(got == rest);
}

TEST_F(Terminator, DeliversWhatIsInFlightWhenThePlainSideCloses) {
  const std::string answer = RandomBytes(400'000, 1);
  // Closes with what the client sent unread, which resets other sockets.
  PlainServer plain([&](int fd) { WritePlain(fd, answer); });
  const auto client = Connect(&plain, {}, 20'000);
  EXPECT_TRUE(client->Write("unread"));
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_TRUE(client->ReadAll() == answer);
  EXPECT_TRUE(client->IsEndClean());
  client->Drop(false);
  EXPECT_TRUE(IsAllClosed());
}

TEST_F(Terminator, DeliversWhatIsInFlightWhenTheClientCloses) {
  const std::string sent = RandomBytes(150'000, 1);
  for (const bool is_clean : {true, false}) {
    std::string got;
    {
      PlainServer plain([&](int fd) {
        std::this_thread::sleep_for(milliseconds(100));
        got = ReadPlain(fd);
      });
      const auto client = Connect(&plain);
      EXPECT_TRUE(client->Write(sent));
      if (is_clean) client->EndWriting();
      client->Drop(false);
      EXPECT_TRUE(IsAllClosed());
    }
    EXPECT_TRUE(got == sent) << got.size();
  }
}

TEST_F(Terminator, AClientThatTakesNothingIsNotWaitedForLong) {
  terminator_ = StartTerminator({.linger = milliseconds(200)});
  PlainServer plain([&](int fd) { FillPlain(fd); });
  const auto client = Connect(&plain, {}, 20'000);
  EXPECT_TRUE(WaitUntil([&] { return plain.taken_count() == 1; }));
  EXPECT_TRUE(IsAllClosed());
}

TEST_F(Terminator, AClientThatDoesNotCloseAfterTheEndIsClosed) {
  PlainServer plain([](int) {});
  const auto client = Connect(&plain);
  EXPECT_EQ(client->ReadAll(), "");
  EXPECT_TRUE(client->IsEndClean());
  EXPECT_TRUE(IsAllClosed());
}

// One connection that ends at a random point in one of many ways.
void DropSomewhere(TlsTerminator* terminator, const std::shared_ptr<const TlsContext>& context,
                   const TlsTerminator::Take& take, std::mt19937_64* random) {
  const TcpPair pair = ConnectTcp();
  terminator->Accept(pair.server, context, "test peer", take);
  TlsClient client(pair.client, {});
  const uint64_t point = (*random)() % 6;
  const std::string part = RandomBytes(1 + (*random)() % 200, (*random)());
  if (point == 1) send(pair.client, part.data(), part.size(), MSG_NOSIGNAL);
  const bool is_connected = point >= 2 && client.Connect();
  EXPECT_EQ(is_connected, point >= 2);
  if (point >= 3) client.Write(RandomBytes(1 + (*random)() % 60'000, (*random)()));
  if (point == 4) client.ReadSome();
  if (point == 5) client.EndWriting();
  client.Drop((*random)() % 2 == 0);
}

TEST_F(Terminator, DroppedConnectionsLeaveNothingBehind) {
  std::mt19937_64 random(test::TestSeed(3));
  const int before = OpenDescriptorCount();
  {
    PlainServer plain(Echo);
    for (int i = 0; i < 200; ++i) {
      DropSomewhere(terminator_.get(), context_, plain.take(), &random);
    }
    EXPECT_TRUE(IsAllClosed());
    EXPECT_EQ(terminator_->handshake_count(), 0);
  }
  EXPECT_EQ(OpenDescriptorCount(), before);
}

TEST_F(Terminator, CertificatesRotateWhileConnectionsGoOn) {
  PlainServer plain(Echo);
  const auto old_client = Connect(&plain);
  EXPECT_EQ(old_client->ServerCommonName(), "server one");
  const Identity next = folder_.Client({.common_name = "server two"});
  folder_.Write("server.pem", next.certificate);
  folder_.Write("server.key", next.key);
  context_ = folder_.Load(false);
  const auto new_client = Connect(&plain);
  EXPECT_EQ(new_client->ServerCommonName(), "server two");
  EXPECT_TRUE(Echoes(old_client.get(), RandomBytes(50'000, 1)));
  EXPECT_TRUE(Echoes(new_client.get(), RandomBytes(50'000, 2)));
}

TEST_F(Terminator, StopClosesEverything) {
  const int before = OpenDescriptorCount();
  terminator_ = StartTerminator({.thread_count = 2});
  {
    PlainServer plain(Echo);
    std::array<std::unique_ptr<TlsClient>, 5> clients;
    for (auto& client : clients) client = Connect(&plain);
    EXPECT_TRUE(Echoes(clients[0].get(), "ping"));
    const TcpPair in_handshake = ConnectTcp();
    terminator_->Accept(in_handshake.server, context_, "test peer", plain.take());
    EXPECT_TRUE(WaitUntil([&] { return plain.taken_count() == 5; }));
    terminator_->Stop();
    EXPECT_EQ(terminator_->open_count(), 0);
    EXPECT_EQ(terminator_->handshake_count(), 0);
    for (const auto& client : clients) EXPECT_EQ(client->ReadSome(), "");
    terminator_->Stop();
    const TcpPair late = ConnectTcp();
    terminator_->Accept(late.server, context_, "test peer", plain.take());
    char byte = 0;
    EXPECT_EQ(recv(late.client, &byte, 1, 0), 0);
    EXPECT_EQ(recv(in_handshake.client, &byte, 1, 0), 0);
    close(late.client);
    close(in_handshake.client);
    EXPECT_EQ(plain.taken_count(), 5);
  }
  terminator_.reset();
  EXPECT_LE(OpenDescriptorCount(), before);
}

TEST_F(Terminator, StopGivesTheLastAnswersTheirTime) {
  const std::string answer = RandomBytes(300'000, 1);
  PlainServer plain([&](int fd) { WritePlain(fd, answer); });
  const auto client = Connect(&plain, {}, 20'000);
  EXPECT_TRUE(WaitUntil([&] { return plain.taken_count() == 1; }));
  std::thread stopper([&] { terminator_->Stop(std::chrono::seconds(10)); });
  const auto begin = Clock::now();
  EXPECT_TRUE(client->ReadAll() == answer);
  client->Drop(false);
  stopper.join();
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(5));
}

}  // namespace
}  // namespace dsg::server
