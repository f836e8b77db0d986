// SPDX-License-Identifier: Apache-2.0
#include "server/tls/tls_context.h"

#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <sys/stat.h>

#include "schema/base/status.h"
#include "tests/unit/server/tls/tls_test_util.h"

namespace dsg::server {
namespace {

// The message of the error with which the options are refused.
std::string WhyRefused(const TlsOptions& options) {
  const auto loaded = TlsContext::Load(options, {"h2"});
  EXPECT_FALSE(loaded.ok());
  EXPECT_EQ(ReasonOf(loaded.status()), Reason::kFieldInvalid) << loaded.status();
  return std::string(loaded.status().message());
}

void ExpectParts(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) {
    EXPECT_NE(text.find(part), std::string::npos) << "no \"" << part << "\" in: " << text;
  }
}

std::string NameOf(const CertificateSpec& spec) {
  const Identity made = MakeIdentity(spec, nullptr);
  BIO* bio = BIO_new_mem_buf(made.certificate.data(), static_cast<int>(made.certificate.size()));
  X509* certificate = PEM_read_bio_X509(bio, nullptr, nullptr, nullptr);
  std::string name = NameInCertificate(certificate);
  X509_free(certificate);
  BIO_free(bio);
  return name;
}

TEST(TlsContext, LoadsAndKnowsWhenItExpires) {
  const TlsFolder folder;
  const auto now = std::chrono::system_clock::now();
  for (const bool mutual : {false, true}) {
    const auto context = folder.Load(mutual, "h2");
    ASSERT_NE(context, nullptr);
    EXPECT_EQ(context->requires_client_certificate(), mutual);
    EXPECT_LT(now + std::chrono::minutes(50), context->expires_at());
    EXPECT_GT(now + std::chrono::minutes(70), context->expires_at());
  }
}

TEST(TlsContext, TheFirstCertificateOfTheChainToExpireCounts) {
  const TlsFolder folder;
  const Identity between =
      MakeIdentity({.common_name = "between", .is_ca = true, .ends_s = 600}, &folder.ca());
  TlsOptions options = folder.Options(false);
  options.certificate_file =
      folder.Write("chain.pem", folder.server().certificate + between.certificate);
  const auto loaded = TlsContext::Load(options, {});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_GT(std::chrono::system_clock::now() + std::chrono::minutes(11), (*loaded)->expires_at());
}

TEST(TlsContext, RefusesAKeyThatOthersCanUse) {
  const TlsFolder folder;
  for (const int mode : {0644, 0640, 0620, 0602}) {
    TlsOptions options = folder.Options(false);
    options.key_file = folder.Write("open.key", folder.server().key, mode);
    ExpectParts(WhyRefused(options), {"open.key", "its mode is 06", "chmod 600"});
  }
}

TEST(TlsContext, RefusesFilesThatAreNotWhatTheyShouldBe) {
  const TlsFolder folder;
  const TlsOptions good = folder.Options(true);
  TlsOptions options = good;
  options.certificate_file = folder.path("missing.pem");
  ExpectParts(WhyRefused(options), {"missing.pem", "No such file", "give the path"});
  options.certificate_file = folder.Write("empty.pem", "");
  ExpectParts(WhyRefused(options), {"empty.pem", "no certificate in it", "BEGIN CERTIFICATE"});
  options.certificate_file = folder.Write("cut.pem", folder.server().certificate.substr(0, 300));
  ExpectParts(WhyRefused(options), {"cut.pem", "certificate number 1", "whole PEM"});
  options.certificate_file = folder.path("");
  ExpectParts(WhyRefused(options), {"no file"});
  options.certificate_file = folder.Write("large.pem", std::string(2 << 20, 'x'));
  ExpectParts(WhyRefused(options), {"large.pem", "1 MiB"});
  options = good;
  options.key_file = folder.Write("none.key", folder.server().certificate);
  ExpectParts(WhyRefused(options), {"none.key", "no private key in it"});
  options.key_file = "";
  ExpectParts(WhyRefused(options), {"the server's key", "path is empty"});
  options = good;
  options.client_ca_file = folder.path("server.pem");
  ExpectParts(WhyRefused(options), {"server.pem", "server one", "not that of a CA"});
}

TEST(TlsContext, RefusesAKeyOfAnotherCertificate) {
  const TlsFolder folder;
  TlsOptions options = folder.Options(false);
  options.key_file = folder.Write("other.key", folder.Client({.common_name = "other"}).key);
  ExpectParts(WhyRefused(options),
              {"other.key", "does not belong to the certificate", "server.pem"});
}

TEST(TlsContext, RefusesAnEncryptedKeyWithoutAskingForThePassphrase) {
  const TlsFolder folder;
  BIO* in =
      BIO_new_mem_buf(folder.server().key.data(), static_cast<int>(folder.server().key.size()));
  EVP_PKEY* key = PEM_read_bio_PrivateKey(in, nullptr, nullptr, nullptr);
  TlsOptions options = folder.Options(false);
  options.key_file = folder.Write("locked.key", "");
  BIO* out = BIO_new_file(options.key_file.c_str(), "w");
  PEM_write_bio_PrivateKey(out, key, EVP_aes_256_cbc(), nullptr, 0, nullptr,
                           const_cast<char*>("secret"));
  BIO_free(out);
  BIO_free(in);
  EVP_PKEY_free(key);
  ExpectParts(WhyRefused(options), {"locked.key", "encrypted", "openssl pkey"});
}

TEST(TlsContext, RefusesCertificatesThatAreNotValidNow) {
  const TlsFolder folder;
  TlsOptions options = folder.Options(false);
  const Identity old =
      folder.Client({.common_name = "old server", .begins_s = -7200, .ends_s = -3600});
  options.certificate_file = folder.Write("old.pem", old.certificate);
  options.key_file = folder.Write("old.key", old.key);
  ExpectParts(WhyRefused(options), {"old.pem", "old server", "expired at 20", "renew it"});
  const Identity early = folder.Client({.common_name = "early", .begins_s = 1800});
  options.certificate_file = folder.Write("early.pem", early.certificate);
  options.key_file = folder.Write("early.key", early.key);
  ExpectParts(WhyRefused(options), {"early.pem", "is valid from 20", "clock"});
  options = folder.Options(true);
  options.client_ca_file = folder.Write(
      "old-ca.pem",
      MakeIdentity({.common_name = "old CA", .is_ca = true, .begins_s = -7200, .ends_s = -60},
                   nullptr)
          .certificate);
  ExpectParts(WhyRefused(options), {"old-ca.pem", "old CA", "expired"});
  // The successor beside it is enough.
  folder.Write("old-ca.pem", test::ReadFile(folder.path("old-ca.pem")) + folder.ca().certificate);
  EXPECT_TRUE(TlsContext::Load(options, {}).ok());
}

TEST(TlsContext, RefusesNamesOfProtocolsThatAlpnCannotWrite) {
  const TlsFolder folder;
  for (const std::string& name : {std::string(), std::string(256, 'h')}) {
    const auto loaded = TlsContext::Load(folder.Options(false), {name});
    EXPECT_EQ(ReasonOf(loaded.status()), Reason::kFieldInvalid);
  }
}

TEST(TlsContext, TakesTheNameFromDnsThenUriThenCommonName) {
  EXPECT_EQ(NameOf({.common_name = "cn", .alternative_names = "URI:urn:robot:7,DNS:r7.example"}),
            "r7.example");
  EXPECT_EQ(NameOf({.common_name = "cn", .alternative_names = "URI:urn:robot:7"}), "urn:robot:7");
  EXPECT_EQ(NameOf({.common_name = "cn", .alternative_names = "email:a@b.example"}), "cn");
  EXPECT_EQ(NameOf({.common_name = "J\u00fcrgen"}), "J\u00fcrgen");
  EXPECT_EQ(NameOf({.common_name = "two\nlines"}), "");
  EXPECT_EQ(NameOf({}), "");
}

}  // namespace
}  // namespace dsg::server
