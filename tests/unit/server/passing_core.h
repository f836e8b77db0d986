// SPDX-License-Identifier: Apache-2.0
// A core that passes every question on to another, for tests that change or count a single one.
#pragma once

#include <string>

#include "query/api/generated/passing_api.h"
#include "query/service/service_core.h"

namespace dsg::server {

class PassingCore : public query::PassingApi<query::ServiceCore> {
 public:
  using PassingApi::PassingApi;

  const std::string& store_folder() const override { return next()->store_folder(); }
};

}  // namespace dsg::server
