// SPDX-License-Identifier: MIT
// Keys of the files of earlier versions that this version does not read.
#include <vector>

#include "base/json_section.hpp"

namespace prism {
namespace {

constexpr std::string_view kServe = "it has no effect; let ser2net serve the line to several programs (lines.md)";

}  // namespace

std::span<const RemovedKey> removed_keys() {
  static const std::vector<RemovedKey> kKeys{
      // {file, path, stops, instead}
      {KeyFile::kPrismd, "line/serve", false, kServe},
      {KeyFile::kPrismd, "sensor_lines/*/serve", false, kServe},
      {KeyFile::kPrismd, "log/keep_for", false,
       "it has no effect; a consumer keeps its own cursor (prismctl rows --cursor)"},
      {KeyFile::kRelay, "postgresql/follower", false, "it has no effect; the relay keeps its cursors in the database"},
      {KeyFile::kRelay, "metrics", false, "it has no effect; let a timer run prismctl metrics (fleet.md)"},
      {KeyFile::kWeb, "foxglove", false, "it has no effect; read the gyro with the Python client (clients.md)"},
      {KeyFile::kWeb, "passwords", true, "let nginx or caddy ask for the passwords (page.md, \"Other hosts\")"},
      {KeyFile::kWeb, "tls", true, "let nginx or caddy have the certificate (page.md, \"Other hosts\")"},
      {KeyFile::kWeb, "plotjuggler", false,
       "it has no effect; run clients/python/examples/plotjuggler.py (clients.md)"},
      {KeyFile::kCampaign, "slurm", false, "write the options of sbatch into the script of docs/campaign.md"},
      {KeyFile::kCampaign, "level", true, "run the printed lines with GLIBC_TUNABLES (docs/campaign.md)"},
      {KeyFile::kCampaign, "limits/data_quality/findings", true, "the verdict pass rejects every warning"},
      {KeyFile::kCampaign, "previous", false, "compare report/tables/gyros.csv of both lots"},
      {KeyFile::kFrames, "stuffing", true, "no description of prism is of stuffed frames"},
      {KeyFile::kFrames, "vectors/*/stuffed", true, "give the bytes of the frame as \"hex\""},
      {KeyFile::kFrames, "kinds/*/length/multiply", true, "a length field counts bytes"},
      {KeyFile::kFrames, "kinds/*/checks/**/word_order", true, "words are added in the \"order\" of the check"},
      {KeyFile::kFrames, "kinds/*/checks/**/covers_mark", true, "the covered bytes end before the \"mark\""},
      {KeyFile::kFrames, "**/convert/*/coefficients", true, "use the step \"table\" with points of the polynomial"},
      {KeyFile::kFrames, "**/convert/*/a", true, "use the step \"table\" with points of the thermistor"},
  };
  return kKeys;
}

}  // namespace prism
