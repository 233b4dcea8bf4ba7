// SPDX-License-Identifier: MIT
#include "tools/prismweb/tls.hpp"

#include <fmt/format.h>
#include <openssl/ssl.h>

#include <cstdlib>

#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "tools/prismweb/secret_file.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using Context = asio::ssl::context;

// RFC 9325, section 4.2: forward secrecy, and ciphers that authenticate (AEAD).
constexpr const char* kCiphersOf12 = "ECDHE+AESGCM:ECDHE+CHACHA20";
constexpr int kWarnDays = 30;

std::string day(const ASN1_TIME* time) {
  std::tm parts{};
  if (::ASN1_TIME_to_tm(time, &parts) != 1) return "an unknown day";
  return fmt::format("{:04}-{:02}-{:02}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday);
}

Result<std::shared_ptr<Context>> make_context() {
  auto context = std::make_shared<Context>(Context::tls_server);
  SSL_CTX* const tls = context->native_handle();
  ::SSL_CTX_set_options(tls, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  if (::SSL_CTX_set_min_proto_version(tls, TLS1_2_VERSION) != 1 || ::SSL_CTX_set_cipher_list(tls, kCiphersOf12) != 1)
    return make_error("tls", "OpenSSL does not support TLS 1.2 with ECDHE and AES-GCM");
  return context;
}

// OpenSSL's default callback would prompt for a passphrase on the terminal.
Result<void> use_key(Context& context, const TlsSettings& settings) {
  const auto key = read_secret_file(settings.key);
  if (!key) return tl::unexpected<Error>(key.error());
  const auto is_encrypted = std::make_shared<bool>(false);
  context.set_password_callback([is_encrypted](std::size_t, Context::password_purpose) {
    *is_encrypted = true;
    return std::string();
  });
  boost::system::error_code error;
  context.use_private_key(asio::buffer(*key), Context::pem, error);
  if (*is_encrypted)
    return make_error(settings.key, "is encrypted, expected a key without a passphrase, as \"openssl pkey\" writes it");
  if (error) return make_error(settings.key, "cannot be used as the certificate's key: " + error.message());
  if (::SSL_CTX_check_private_key(context.native_handle()) != 1)
    return make_error(settings.key, "is not the key of " + settings.certificate);
  return {};
}

}  // namespace

Result<Tls> load_tls(const TlsSettings& settings) {
  auto context = make_context();
  if (!context) return tl::unexpected<Error>(context.error());
  const auto chain = read_text_file(settings.certificate);
  if (!chain) return tl::unexpected<Error>(chain.error());
  boost::system::error_code error;
  (*context)->use_certificate_chain(asio::buffer(*chain), error);
  if (error) return make_error(settings.certificate, "cannot be used as the certificate: " + error.message());
  if (const auto used = use_key(**context, settings); !used) return tl::unexpected<Error>(used.error());
  const X509* const certificate = ::SSL_CTX_get0_certificate((*context)->native_handle());
  const std::string validity = certificate != nullptr ? validity_warning(*certificate, std::time(nullptr)) : "";
  return Tls{std::move(*context), validity.empty() ? "" : Error{settings.certificate, validity}.text()};
}

std::string validity_warning(const X509& certificate, std::time_t now) {
  const ASN1_TIME* const begin = ::X509_get0_notBefore(&certificate);
  const ASN1_TIME* const end = ::X509_get0_notAfter(&certificate);
  const std::unique_ptr<ASN1_TIME, decltype(&::ASN1_TIME_free)> current(::ASN1_TIME_set(nullptr, now),
                                                                        &::ASN1_TIME_free);
  int days = 0, seconds = 0;
  if (!current || ::ASN1_TIME_diff(&days, &seconds, current.get(), begin) != 1) return "validity dates cannot be read";
  if (days > 0 || seconds > 0) return fmt::format("is not valid before {}; browsers reject it until then", day(begin));
  if (::ASN1_TIME_diff(&days, &seconds, current.get(), end) != 1) return "validity dates cannot be read";
  const std::string distance = counted(static_cast<std::size_t>(std::abs(days)), "day");
  if (days < 0 || seconds < 0) return fmt::format("expired on {}, {} ago; browsers reject it", day(end), distance);
  if (days < kWarnDays) return fmt::format("expires on {}, in {}", day(end), distance);
  return "";
}

}  // namespace prism::prismweb
