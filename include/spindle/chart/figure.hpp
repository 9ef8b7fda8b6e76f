#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

/// Figures for a page that is read without a script and printed: numbers in, the text of an <svg>
/// out. Every text is escaped here, so callers hand in names and barcodes as they are. Numbers that
/// are not finite are left out and counted in the legend. The same input gives the same bytes.
namespace spindle::chart {

/// A picture has fixed proportions, and its letters shrink with it: `narrow` is laid out for the
/// width of a phone.
enum class Format : std::uint8_t { wide, narrow };

/// The description is for those who do not see the figure; what was counted is added to it.
struct Caption {
  std::string title;
  std::string description = {};
};

/// What an axis shows. Its values have so many decimals, means one more.
struct Quantity {
  std::string name;
  std::string unit = {};
  int decimals = 2;
};

/// What runs to the right in a chart of results: their number, or the time as milliseconds since
/// 1970-01-01 UTC. One offset for the whole chart, which the axis names.
enum class Along : std::uint8_t { index, time };

struct Course {
  Along along = Along::index;
  std::string name = "Result";
  int utc_offset_minutes = 0;
};

enum class LevelKind : std::uint8_t { specification_limit, control_limit, target, mean };

/// A horizontal line of a run or control chart, a vertical one of a histogram.
struct Level {
  LevelKind kind = LevelKind::mean;
  double value = 0;
  std::string name;         ///< "USL"
  std::string origin = {};  ///< who says so: "tool's own"
  /// Where it holds along the course; everywhere unless said.
  std::optional<std::int64_t> from = std::nullopt;
  std::optional<std::int64_t> to = std::nullopt;
};

/// From then on something is different: "settings changed".
struct Change {
  std::int64_t at = 0;
  std::string word;
};

/// Results that are known to be missing. By index, those between the results `from` and `to`.
struct Gap {
  std::int64_t from = 0;
  std::int64_t to = 0;
  std::uint64_t missed = 0;
};

/// The style of a page with figures, for one <style> element. A figure alone is readable without.
std::string_view style();

/// Both formats of a figure as one element: the style shows the one that fits.
std::string pair(std::string_view wide, std::string_view narrow);

}  // namespace spindle::chart
