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
  [[nodiscard]] report::Record gap(const device::EventGap& news, WallTime time,
                                   const Naming& naming) const;
  [[nodiscard]] report::Record lag(const device::PollLag& news, WallTime time) const;
  [[nodiscard]] report::Record link(const device::LinkChange& news, WallTime time) const;

  /// What an event says; `other` where the profile does not know.
  [[nodiscard]] catalogue::EventKind kind_of(const Registers& block) const;

  /// Meaning of an error code; empty when it is 0 or unknown.
  [[nodiscard]] std::string error_text(std::int64_t code) const;

 private:
  [[nodiscard]] report::Record blank(std::string type, WallTime time) const;
  void add_name(report::Record& record, const Naming& naming) const;

  const Target* target_;
  std::optional<catalogue::EventLayout> layout_ = std::nullopt;  ///< where the profile has events
  std::string error_key_ = {};  ///< of the code that the texts explain
  bool has_torque_ = false;     ///< in the unit that is set on the tool
  catalogue::CodeTables tables_;
};

/// Columns of a stream of news, drawn row by row, with those that the profiles of its tools want.
enum class Tools : std::uint8_t { one, several };
std::vector<report::Column> news_columns(Tools tools,
                                         const std::vector<const catalogue::Profile*>& profiles);

}  // namespace spindle::commands
