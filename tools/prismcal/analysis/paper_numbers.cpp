// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/paper_numbers.hpp"

#include <map>

namespace prism::analysis {
namespace {

/// Values as in the tables: F(x) in 1e-3 deg/h, improvement in percent.
PaperRow kernel_row(double c, double sigma2, double cost, double after, double improvement) {
  return {c, sigma2, cost * 1e-3, after, improvement / 100};
}

PaperRow polynomial_row(double after, double improvement) { return {{}, {}, {}, after, improvement / 100}; }

const std::map<std::string, PaperRow>& rows() {
  static const std::map<std::string, PaperRow> kRows = {
      // Table 2
      {"ls T", polynomial_row(0.01194, 35.46)},
      {"ls dTdt", polynomial_row(0.01702, 8.00)},
      {"ls U", polynomial_row(0.01100, 40.54)},
      // Table 3
      {"stepwise T,dTdt", polynomial_row(0.00942, 49.08)},
      {"stepwise T,dTdt,U", polynomial_row(0.00842, 54.49)},
      // Table 4
      {"ir-lssvm T huber shuffled", kernel_row(1.5958e2, 0.0356, 8.5410, 0.01105, 40.27)},
      {"ir-lssvm T hampel shuffled", kernel_row(78.6103, 0.4086, 8.5280, 0.01123, 39.30)},
      {"ir-lssvm T logistic shuffled", kernel_row(9.3665e8, 0.2138, 8.4047, 0.01089, 41.14)},
      {"ir-lssvm T myriad shuffled", kernel_row(1.9285e4, 0.0742, 8.4990, 0.01090, 41.08)},
      {"ir-lssvm dTdt huber shuffled", kernel_row(8.2961e3, 7.2794, 13.1121, 0.01712, 7.46)},
      {"ir-lssvm dTdt hampel shuffled", kernel_row(1.0207, 0.0003, 12.6074, 0.01357, 26.65)},
      {"ir-lssvm dTdt logistic shuffled", kernel_row(1.4421, 0.0003, 12.7182, 0.01356, 26.70)},
      {"ir-lssvm dTdt myriad shuffled", kernel_row(1.0537, 3.8071, 13.1177, 0.01714, 7.35)},
      {"ir-lssvm U huber shuffled", kernel_row(0.2718, 0.0044, 8.1178, 0.01009, 45.46)},
      {"ir-lssvm U hampel shuffled", kernel_row(0.1643, 0.0065, 8.1610, 0.01024, 44.65)},
      {"ir-lssvm U logistic shuffled", kernel_row(0.2691, 0.0070, 8.1394, 0.01021, 44.81)},
      {"ir-lssvm U myriad shuffled", kernel_row(0.1955, 0.0060, 8.1437, 0.01015, 45.14)},
      // Table 5
      {"ir-lssvm T,dTdt huber shuffled", kernel_row(1.2538e3, 0.2065, 6.5456, 0.00755, 59.19)},
      {"ir-lssvm T,dTdt hampel shuffled", kernel_row(1.1991, 0.0930, 6.6019, 0.00794, 57.08)},
      {"ir-lssvm T,dTdt logistic shuffled", kernel_row(3.5476e2, 0.1399, 6.5949, 0.00757, 59.08)},
      {"ir-lssvm T,dTdt myriad shuffled", kernel_row(1.8752e3, 0.2041, 6.5080, 0.00752, 59.35)},
      {"ir-lssvm T,U huber shuffled", kernel_row(4.3846e3, 0.0390, 7.0111, 0.00789, 57.35)},
      {"ir-lssvm T,U hampel shuffled", kernel_row(79.8662, 0.0297, 7.1130, 0.00823, 55.51)},
      {"ir-lssvm T,U logistic shuffled", kernel_row(6.2443e2, 0.0304, 7.0946, 0.00807, 56.38)},
      {"ir-lssvm T,U myriad shuffled", kernel_row(8.4177, 0.0045, 7.1402, 0.00743, 59.84)},
      {"ir-lssvm dTdt,U huber shuffled", kernel_row(2.4444e4, 1.6025, 6.7729, 0.00818, 55.78)},
      {"ir-lssvm dTdt,U hampel shuffled", kernel_row(0.7546, 0.2386, 6.8129, 0.00837, 54.76)},
      {"ir-lssvm dTdt,U logistic shuffled", kernel_row(1.9995, 0.2144, 6.8975, 0.00832, 55.03)},
      {"ir-lssvm dTdt,U myriad shuffled", kernel_row(1.4267, 0.3799, 6.9093, 0.00838, 54.70)},
      {"ir-lssvm T,dTdt,U huber shuffled", kernel_row(4.0580e5, 2.2799, 6.4217, 0.00740, 60.00)},
      {"ir-lssvm T,dTdt,U hampel shuffled", kernel_row(26.3212, 0.1263, 6.4479, 0.00733, 60.38)},
      {"ir-lssvm T,dTdt,U logistic shuffled", kernel_row(3.4780e4, 1.0623, 6.4218, 0.00740, 60.00)},
      {"ir-lssvm T,dTdt,U myriad shuffled", kernel_row(76.0796, 0.1458, 6.3711, 0.00718, 61.19)},
      {"lssvm T,dTdt,U loo", kernel_row(1.3624e3, 0.9771, 6.6791, 0.00758, 59.03)},
  };
  return kRows;
}

}  // namespace

std::optional<PaperRow> paper_row(const ModelSpec& spec) {
  const auto found = rows().find(spec.key());
  if (found == rows().end()) return std::nullopt;
  return found->second;
}

}  // namespace prism::analysis
