#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/catalogue/event_layout.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/device/watcher.hpp"
#include "spindle/report/renderer.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// What names an event for ever, with its number.
struct Naming {
  std::string serial = {};                           ///< empty: the tool says none
  std::optional<std::int64_t> epoch = std::nullopt;  ///< empty: no store was asked
  std::optional<std::int64_t> id = std::nullopt;     ///< of its row, where it is stored
};

/// Turns the news of one tool into records. Everything that the profile says of event blocks is
/// looked up once, so that an event costs little.
class NewsRecords {
 public:
  /// `target` and `profile` must outlive it.
  NewsRecords(const Target& target, const catalogue::Profile& profile,
              catalogue::CodeTables tables);

  [[nodiscard]] report::Record event(const device::ToolEvent& news, const Naming& naming) const;
  /// `type` is "change" or "sample".
  [[nodiscard]] report::Record value(const device::PolledValue& news, const std::string& type,
                                     WallTime time) const;
  [[nodiscard]] report::Record motor(const device::MotorTransition& news) const;
  /// Adds the units of an event's fields, for files that have a column for each.
  void add_units(report::Record& record) const;
  /// Curves of an event, or of none that was seen, with all samples. Requires a profile with
  /// curves.
  [[nodiscard]] report::Record curve(const device::ToolCurve& news, const Naming& naming) const;
  /// The same without the samples: what is stored beside them.
  [[nodiscard]] report::Record curve_header(const device::ToolCurve& news,
                                            const Naming& naming) const;
  /// The unit of the torques of a block; empty: it is not known.
  [[nodiscard]] std::string torque_unit_of(const Registers& block) const;
  [[nodiscard]] report::Record gap(const device::EventGap& news, WallTime time,
                                   const Naming& naming) const;
  [[nodiscard]] report::Record lag(const device::PollLag& news, WallTime time) const;
  [[nodiscard]] report::Record link(const device::LinkChange& news, WallTime time) const;

  /// What an event says; `other` where the profile does not know.
  [[nodiscard]] catalogue::EventKind kind_of(const Registers& block) const;

  /// The field that says the preset of an event; empty where none does.
  [[nodiscard]] const std::string& preset_key() const { return preset_key_; }

  /// Meaning of an error code; empty when it is 0 or unknown.
  [[nodiscard]] std::string error_text(std::int64_t code) const;

 private:
  [[nodiscard]] report::Record blank(std::string type, WallTime time) const;
  void add_name(report::Record& record, const Naming& naming) const;
  void add_steps(report::Record& record, const Registers& block) const;

  const Target* target_;
  const catalogue::Profile* profile_;
  std::optional<catalogue::EventLayout> layout_ = std::nullopt;  ///< where the profile has events
  std::string error_key_ = {};  ///< of the code that the texts explain
  std::string preset_key_ = {};
  bool has_torque_ = false;  ///< in the unit that is set on the tool
  std::vector<report::Field> units_ = {};
  catalogue::CodeTables tables_;
};

enum class Tools : std::uint8_t { one, several };

/// Whose news a stream tells.
struct NewsSources {
  Tools tools = Tools::one;
  std::vector<const catalogue::Profile*> profiles = {};
  std::vector<std::string> torque_units = {};  ///< of the tools; empty: not known
};

/// Columns of a stream of news, drawn row by row, with those that the profiles of its tools want. A
/// unit that all torques have stands in the head of their column, else in one of its own.
std::vector<report::Column> news_columns(const NewsSources& sources);

/// Columns of a file for other programs: everything that any record of these tools says, with its
/// unit. The same for one tool and for several.
std::vector<report::Column> exchange_columns(
    const std::vector<const catalogue::Profile*>& profiles);

/// Adds a column unless there is one with its key.
void add_new(std::vector<report::Column>& columns, report::Column column);

/// Every field of the events of a profile, each with its unit.
void add_event_fields(std::vector<report::Column>& columns, const catalogue::Profile& profile);

}  // namespace spindle::commands
