// SPDX-License-Identifier: Apache-2.0
#include "query/client/credential_flags.h"

#include <CLI/CLI.hpp>
#include <string>

namespace dsg::client {

void AddCredentialFlags(CLI::App* app, CredentialFiles* files, bool is_hidden) {
  const auto add = [&](const std::string& name, std::string* path, const std::string& variable,
                       const std::string& what) {
    CLI::Option* option = app->add_option(name, *path, what)->envname(variable)->type_name("FILE");
    if (is_hidden) option->group("");
  };
  add("--token-file", &files->token, "DSG_TOKEN_FILE",
      "With --server: the token that says who calls, in its first line; only you may read it");
  add("--tls-ca", &files->authorities, "DSG_TLS_CA",
      "With --server: encrypt, and trust a server that these authorities vouch for (PEM)");
  add("--tls-cert", &files->certificate, "DSG_TLS_CERT",
      "With --tls-ca: certificate that says who calls (PEM)");
  add("--tls-key", &files->key, "DSG_TLS_KEY", "Its key (PEM); only you may read it");
}

}  // namespace dsg::client
