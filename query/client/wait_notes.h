// SPDX-License-Identifier: Apache-2.0
// Tells people that a call waits for a server, why, and how much longer it will.
// Refuses to decide anything, and says nothing about calls that are answered soon.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace dsg::client {

/// Gets one sentence; called from any thread, one at a time.
using TellWait = std::function<void(const std::string&)>;

/// Threads: one caller at a time; a thread of its own speaks while a call hangs.
class WaitNotes {
 public:
  using Clock = std::chrono::steady_clock;

  /// What is said when. Tests make it shorter.
  struct Pace {
    /// An unanswered call is spoken of after so long; a failed one at once.
    std::chrono::milliseconds silence_max = std::chrono::seconds(3);
    std::chrono::milliseconds repeat_every = std::chrono::seconds(5);
  };

  /// `tell` may be empty: then nothing is ever said.
  WaitNotes(std::string address, TellWait tell);
  WaitNotes(std::string address, TellWait tell, const Pace& pace);
  ~WaitNotes();
  WaitNotes(const WaitNotes&) = delete;
  WaitNotes& operator=(const WaitNotes&) = delete;

  /// `give_up`: when the caller stops asking.
  void CallBegins(Clock::time_point give_up);
  /// `why`: what the transport or the server said.
  void AttemptFailed(const std::string& why);
  void CallEnds(bool is_answered);

 private:
  void Run();
  void SayWaiting(Clock::time_point now);

  const std::string address_;
  const TellWait tell_;
  const Pace pace_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_stopping_ = false;
  bool is_busy_ = false;
  bool has_spoken_ = false;
  Clock::time_point begin_;
  Clock::time_point give_up_;
  Clock::time_point speak_next_;
  std::string why_;
  std::thread thread_;
};

}  // namespace dsg::client
