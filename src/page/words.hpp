#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "page/board.hpp"
#include "spindle/base/clock.hpp"

/// What is said on the page, as plain text.
namespace spindle::page {

/// 27100 as "2.71": two decimals, more where they are needed.
std::string torque_text(std::int64_t steps);
/// "N·m" of "N.m".
std::string unit_text(std::string_view unit);
/// "14:03:22", with the day in front where it is another than that of `now`: "29 Nov, 14:03:22".
std::string time_text(WallTime at, WallTime now, const Clock& clock);
/// The same without seconds.
std::string minute_text(WallTime at, WallTime now, const Clock& clock);
/// "NG, 3.10 N·m, E335 final torque out of limits".
std::string spoken(const Fastening& result, std::string_view unit);
/// "3 results missed", "at least 3 results missed", "perhaps results missed".
std::string missed_words(const MissedSum& sum);
/// "3", "3 or more", "0?": the same as a figure.
std::string missed_figure(const MissedSum& sum);

/// Whether a recorder is at work on the store.
enum class Recorder : std::uint8_t { runs, stopped, unknown };

/// How a tool's link is shown. Only what is fresh is called connected.
enum class LinkShown : std::uint8_t { up, down, unknown };
struct LinkView {
  LinkShown shown = LinkShown::unknown;
  std::string word = {};    ///< "Connected"
  std::string detail = {};  ///< "since 14:03: closed by the tool"

  friend bool operator==(const LinkView&, const LinkView&) = default;
};
LinkView link_view(const Station& station, Recorder recorder, WallTime now, const Clock& clock);

}  // namespace spindle::page
