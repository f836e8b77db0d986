// SPDX-License-Identifier: Apache-2.0
#include "tests/support/full_disk.h"

#include <signal.h>

#include <cstdlib>

namespace dsg::test {

// The write that meets the limit returns an error only if the signal does not end the process.
FullDisk::FullDisk(int64_t bytes) : handler_before_(signal(SIGXFSZ, SIG_IGN)) {
  if (getrlimit(RLIMIT_FSIZE, &limit_before_) != 0) std::abort();
  rlimit limit = limit_before_;
  limit.rlim_cur = static_cast<rlim_t>(bytes);
  if (setrlimit(RLIMIT_FSIZE, &limit) != 0) std::abort();
}

FullDisk::~FullDisk() {
  setrlimit(RLIMIT_FSIZE, &limit_before_);
  signal(SIGXFSZ, handler_before_);
}

}  // namespace dsg::test
