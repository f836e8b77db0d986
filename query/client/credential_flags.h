// SPDX-License-Identifier: Apache-2.0
// The options by which a program takes the credentials of a client.
#pragma once

#include "query/client/credentials.h"

namespace CLI {
class App;
}

namespace dsg::client {

/// --token-file, --tls-ca, --tls-cert and --tls-key, or DSG_TOKEN_FILE, DSG_TLS_CA, DSG_TLS_CERT
/// and DSG_TLS_KEY. `files` must outlive the parsing. `is_hidden`: not in the help, for programs
/// that say elsewhere what they are.
void AddCredentialFlags(CLI::App* app, CredentialFiles* files, bool is_hidden = false);

}  // namespace dsg::client
