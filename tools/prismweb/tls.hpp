// SPDX-License-Identifier: MIT
// TLS of prismweb: the certificate, its key, and the ciphers that are offered.
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
  std::string warning;  ///< one line about the certificate's validity; empty if it is good for a month or more
};

/// Reads certificate and key. The context offers TLS 1.3, and TLS 1.2 with ECDHE and AES-GCM or ChaCha20-Poly1305.
/// Errors: a file that cannot be read or parsed, a key that other users may read, that has a passphrase, or that is not
/// the certificate's.
Result<Tls> load_tls(const TlsSettings& settings);

/// Describes a certificate that is not valid at `now`, or that ends within 30 days: "expired on 2026-11-24, 1 day ago".
/// Empty if neither is so.
std::string validity_warning(const X509& certificate, std::time_t now);

}  // namespace prism::prismweb
