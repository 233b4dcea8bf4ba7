// SPDX-License-Identifier: MIT
#include "tools/prismweb/tls.hpp"

#include <gtest/gtest.h>

namespace prism::prismweb {
namespace {

constexpr std::time_t kValidDay_s = 86400, kValidFrom_s = 1767225600;  // 2026-01-01

TEST(Certificates, WarnBeforeExpiryAndIfNotValid) {
  const std::unique_ptr<X509, decltype(&::X509_free)> certificate(::X509_new(), &::X509_free);
  ::ASN1_TIME_set(::X509_getm_notBefore(certificate.get()), kValidFrom_s);
  ::ASN1_TIME_set(::X509_getm_notAfter(certificate.get()), kValidFrom_s + 100 * kValidDay_s);
  const auto warning = [&](std::time_t day) {
    return validity_warning(*certificate, kValidFrom_s + day * kValidDay_s);
  };
  EXPECT_EQ(warning(-1), "is not valid before 2026-01-01; browsers reject it until then");
  EXPECT_EQ(warning(0), "");
  EXPECT_EQ(warning(70), "");
  EXPECT_EQ(warning(71), "expires on 2026-04-11, in 29 days");
  EXPECT_EQ(warning(101), "expired on 2026-04-11, 1 day ago; browsers reject it");
}

}  // namespace
}  // namespace prism::prismweb
