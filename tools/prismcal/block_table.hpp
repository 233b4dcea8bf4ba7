// SPDX-License-Identifier: MIT
// A recording as blocks, the samples of the paper: features and bias of each block, and its 1 Hz bias series.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/features.hpp"
#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/series.hpp"

namespace prism::recordings {

/// A session that begins after a longer time without data begins with a switch-on.
inline constexpr std::int64_t kOff_s = 300;

struct BlockTable {
  std::string name;  ///< name of the recording in reports
  compensation::FeatureDefinition features;
  double earth_rate_deg_per_h = 0;            ///< subtracted from the rate
  std::vector<compensation::Window> blocks;   ///< ready windows, length_s apart; the grid restarts after each gap
  std::vector<compensation::Window> warming;  ///< windows that are not ready, one a second
  std::vector<bool> follows;                  ///< block i starts at the end of block i − 1
  std::vector<double> bias_deg_per_h;         ///< block mean of the rate − Earth rate, one per block
  std::vector<Series> seconds;                ///< rate with Earth rate
  std::vector<std::int64_t> restarts;         ///< first seconds of the sessions whose time went back
  std::int64_t first_s = 0, last_s = 0;       ///< first and last second, also without a rate
  bool is_date = false;                       ///< seconds count from 1970
  std::vector<std::int64_t> starts;           ///< first seconds after a switch-on, in order
  /// Seconds without a row or without a rate, and those without a temperature for longer than max_gap_s.
  std::size_t missing_s = 0;
  std::size_t unused_s = 0;  ///< those of them that have a row
  std::size_t gaps = 0;      ///< contiguous runs of such seconds
  std::size_t missing_frames = 0;
  double rate_step_deg_per_h = 0;  ///< of a coarsely rounded rate (rounding_step()); 0: finer than its noise
  std::string spikes;              ///< spikes_text()

  std::size_t size() const { return blocks.size(); }
  std::int64_t second(std::size_t block) const { return blocks[block].second_mean.second; }  ///< its last one
  std::vector<double> column(
      const std::string& input) const;     ///< values of an input ("T", "dTdt", "U", …), one per block
  std::vector<double> hours() const;       ///< end of each block since the start of the first, h
  double mean_rate_deg_per_h() const;      ///< over the blocks, with the Earth rate
  std::vector<double> second_sds() const;  ///< sd of the one-second means of each block; kUnknown: its last is missing
};

/// Runs one-second means through FeatureExtractor, as prismd does, and keeps the windows that end a block. Skips
/// partial seconds. No window spans two sessions. A session that starts before the end of the previous one (the clock
/// was set back) is shifted to follow it.
class BlockTableBuilder {
 public:
  BlockTableBuilder(const compensation::FeatureDefinition& features, double earth_rate_deg_per_h, std::string name);

  /// Errors: a second out of order within a session.
  Result<void> push(const compensation::SecondMean& second_mean, bool begins_session = false);
  /// Errors: no full block, because the recording has no rate or temperature or other clocks, is too short or full
  /// of gaps.
  Result<BlockTable> finish();

 private:
  void add_second(const compensation::SecondMean& second_mean);
  void miss(std::size_t seconds, bool have_rows);
  void add_window(const compensation::Window& window);

  BlockTable table_;
  compensation::FeatureExtractor extractor_;
  std::size_t pushed_ = 0;
  std::size_t sparse_ = 0;                     ///< seconds that end a gap longer than features.max_gap_s
  std::size_t whole_ = 0, clocks_differ_ = 0;  ///< seconds that are not partial, and those of them with other clocks
  bool any_rate_ = false, any_temperature_ = false;
  std::int64_t shift_s_ = 0;                      ///< added to the seconds of this session
  std::optional<std::int64_t> last_;              ///< shifted
  std::optional<std::int64_t> last_temperature_;  ///< second of the last known temperature
  std::size_t without_temperature_ = 0;           ///< used seconds since then
  bool session_begins_ = false;                   ///< since the last second that was used
  bool in_gap_ = false, on_grid_ = false;         ///< on_grid_: the grid restarts after each gap
  std::int64_t next_end_ = 0;
};

/// A recording and its blocks.
struct Loaded {
  Recording recording;
  BlockTable table;
};

/// Reads a recording and makes its blocks. `check` is called before the first second; it may complete the `features`.
/// Errors: also those of `check` and of check_unit().
Result<Loaded> read_blocks(const std::string& path, const SourceOptions& source, const SiteOptions& site,
                           const compensation::FeatureDefinition& features,
                           const std::function<Result<void>(const Recording&)>& check);

/// Returns the rates (deg/h, with Earth rate) of up to 32 evenly spaced seconds of a recording as [[second, rate], …].
/// Stored in the model, it identifies the same data in another file, also if cut or converted.
nlohmann::ordered_json fingerprint_json(const BlockTable& table);

/// Returns one line about the data that the recording shares with the training recordings in the model's provenance:
/// files with the same SHA-256, or seconds with the same rate within 2e-6 deg/h, the resolution of a log, or nearly
/// all, and eight or more, within a tenth of the noise, also if all times differ by the same number of seconds. Seconds
/// of a rate whose steps exceed its noise are not compared. Empty if they share no data. Empty also for a model without
/// a fingerprint (version 0.1), where this is unknown.
std::string overlap_text(const std::string& provenance_json, const Recording& recording, const BlockTable& table);

}  // namespace prism::recordings
