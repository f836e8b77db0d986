// SPDX-License-Identifier: Apache-2.0
// Every call of proto/dsg/v1 as a C++ function: class Api. The class is generated from the service
// protos by proto/generate_api.cc into query/api/generated in the build folder.
#pragma once

#include "query/api/generated/api.h"
