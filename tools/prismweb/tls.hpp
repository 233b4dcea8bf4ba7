// SPDX-License-Identifier: MIT
// TLS context of prismweb: certificate, key, ciphers.
#pragma once

#include <openssl/x509.h>

#include <boost/asio/ssl/context.hpp>
#include <ctime>
#include <memory>
#include <string>

#include "base/result.hpp"
#include "tools/prismweb/settings.hpp"

namespace prism::prismweb {

struct Tls {
  std::shared_ptr<boost::asio::ssl::context> context;
  std::string warning;  ///< one line; empty if the certificate is valid for 30 days or more
};

/// Reads certificate and key. The context offers TLS 1.3, and TLS 1.2 with ECDHE and AES-GCM or ChaCha20-Poly1305.
/// Errors: a file cannot be read or parsed; the key is readable by other users, has a passphrase, or does not match the
/// certificate.
Result<Tls> load_tls(const TlsSettings& settings);

/// Returns a warning if the certificate is not valid at `now` or expires within 30 days, such as "expires on
/// 2026-12-24, in 29 days"; else an empty string.
std::string validity_warning(const X509& certificate, std::time_t now);

}  // namespace prism::prismweb
