#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "page/shift.hpp"
#include "spindle/base/decimal.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/commands/metrics.hpp"
#include "spindle/store/rows.hpp"

namespace spindle::page {

/// What a profile says of the rows of its tools.
struct ProductWords {
  std::optional<std::int64_t> loosening = std::nullopt;  ///< direction of what is no fastening
  catalogue::CodeTables codes = {};
};

/// By the id of a profile; nothing is known of one that is not there any more.
using WordsOf = std::function<const ProductWords&(const std::string& profile)>;

/// The end of one fastening.
struct Fastening {
  WallTime at = {};
  bool is_ok = false;
  bool is_old = false;  ///< it stood in the tool when that was found: its age is not known
  std::uint16_t number = 0;
  std::optional<std::int64_t> torque = std::nullopt;  ///< in ten-thousandths of the tool's unit
  std::int64_t error = 0;                             ///< 0: none
  std::string text = {};                              ///< what the error means, where it is known
  std::string remedy = {};
  std::string barcode = {};
};

/// What a tool reported of itself and has not taken back.
struct Trouble {
  std::string what = {};  ///< "Alarm 30h", "Warning 05h", "Error E113"
  std::string text = {};
  std::string remedy = {};
  WallTime at = {};
};

/// Results that are missing.
struct Miss {
  WallTime at = {};
  std::optional<std::uint32_t> count = std::nullopt;  ///< empty: not known
  bool at_least = false;
  std::string reason = {};
};

/// The last thing that was stored about a connection.
struct LinkNews {
  std::string state = {};  ///< as in JSON: connecting, connected, lost, reconnecting
  std::string message = {};
  WallTime at = {};
  std::optional<WallTime> down_since = std::nullopt;  ///< empty: it is not down
};

struct MotorNews {
  std::string kind = {};  ///< started, at-speed, stopped; empty: not known
  std::optional<Decimal> speed = std::nullopt;
  WallTime at = {};
};

/// What is shown of one target: the tool that was reached there last.
struct Station {
  std::string name = {};
  store::RowId tool = 0;  ///< 0: none was ever reached
  std::string maker = {};
  std::string serial = {};
  std::string model = {};
  std::string profile = {};
  std::string unit = {};                         ///< of torque; empty: not known
  std::optional<WallTime> heard = std::nullopt;  ///< when the tool was there for certain
  std::optional<LinkNews> link = std::nullopt;
  std::optional<std::int64_t> preset = std::nullopt;
  std::optional<std::int64_t> target_torque = std::nullopt;
  std::optional<Fastening> last = std::nullopt;
  std::optional<MotorNews> motor = std::nullopt;
  std::optional<Trouble> alarm = std::nullopt;
  std::optional<Trouble> warning = std::nullopt;
  std::uint64_t ok = 0;  ///< of the shift
  std::uint64_t ng = 0;
  std::vector<Miss> misses = {};      ///< of the shift
  std::deque<Fastening> recent = {};  ///< of the present preset, the newest last
  std::optional<store::RowId> place = std::nullopt;
};

/// How many results of a shift are missing.
struct MissedSum {
  std::uint64_t count = 0;
  bool at_least = false;   ///< there may be more
  bool is_unsure = false;  ///< of a gap it is not known how many, if any
};
MissedSum sum_of(const std::vector<Miss>& misses);

/// What is known of all tools, from the rows of a store in their order. Pure.
class Board {
 public:
  /// So many results are in a chart.
  static constexpr std::size_t most_recent = 60;

  Board(Shift shift, WordsOf words) : shift_(shift), words_(std::move(words)) {}

  /// Who is where. Places of the store, the oldest first, and again whenever they may have changed.
  void note(const store::Place& place, const store::Tool* tool);
  /// `place` is that of the row. Of one from before the shift it is known what was last, but
  /// nothing is counted.
  void note(const store::EventView& row, const store::Place& place);
  void note(const store::Gap& row, const store::Place& place);
  /// `place`: where its tool is; null where it has none or it is not known.
  void note(const store::Happening& row, const store::Place* place);
  /// A new shift has begun: what is counted begins with it.
  void begin(Shift shift);
  /// Counts go on from those of another board.
  void inherit(const Board& other) { totals_ = other.totals_; }

  [[nodiscard]] const std::map<std::string, Station>& stations() const { return stations_; }
  /// Results and gaps, counted up as long as the program runs, over shifts.
  [[nodiscard]] const commands::Metrics& totals() const { return totals_; }
  [[nodiscard]] const Shift& shift() const { return shift_; }
  /// The names of stations that changed since they were asked for.
  std::set<std::string> take_changed() { return std::exchange(changed_, {}); }
  /// What should be said to those who do not see the page, since it was asked for.
  std::vector<std::string> take_said() { return std::exchange(said_, {}); }

 private:
  Station& touch(const std::string& name);
  void note_fastening(const store::EventView& row, Station& station, const ProductWords& words);
  void note_link(const store::Happening& row, const store::Place* place);
  void note_motor(const store::Happening& row, const store::Place* place);
  void say(const Station& station, const std::string& words, WallTime at);

  Shift shift_;
  WordsOf words_;
  std::map<std::string, Station> stations_ = {};
  std::map<store::RowId, std::string> name_of_tool_ = {};  ///< where it was reached last
  std::set<std::string> changed_ = {};
  std::vector<std::string> said_ = {};
  commands::Metrics totals_ = {};
};

}  // namespace spindle::page
