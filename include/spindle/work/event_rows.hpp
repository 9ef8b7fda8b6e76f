#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "spindle/catalogue/event_layout.hpp"
#include "spindle/device/event_source.hpp"
#include "spindle/store/rows.hpp"
#include "spindle/store/writer.hpp"

namespace spindle::work {

/// Whether a column is kept in ten-thousandths of its unit.
bool is_torque(store::Column column);

/// The events of one product as rows of a store, and back. Everything that the profile says of
/// event blocks is looked up once.
class EventRows {
 public:
  /// Requires a profile with events, which must outlive it.
  explicit EventRows(const catalogue::Profile& profile);

  /// The row of an event; tool and place are still to be named.
  [[nodiscard]] store::Event row(const device::ToolEvent& news) const;

  /// The preset that an event was made with; empty: the product does not say.
  [[nodiscard]] std::optional<std::int64_t> preset_of(RegisterView block) const;

  /// Whether an event says that a preset was changed or chosen.
  [[nodiscard]] bool is_preset_change(RegisterView block) const;

  /// The numbers of the presets whose settings are kept with results.
  [[nodiscard]] const std::vector<std::int64_t>& presets() const { return presets_; }

  /// What to read of one preset; none where the profile does not say it.
  [[nodiscard]] std::vector<catalogue::Parameter> settings_of(std::int64_t preset) const;

  /// What was read of one preset, as a row; tool and time are still to be named. Empty where
  /// nothing could be read.
  [[nodiscard]] std::optional<store::PresetSettings> settings_row(
      std::int64_t preset, const std::vector<device::Reading>& readings) const;

 private:
  const catalogue::Profile* profile_;
  catalogue::EventLayout layout_;
  std::vector<std::int64_t> presets_ = {};
};

/// A stored event as the news that it was.
device::ToolEvent news_of(const store::EventView& row);

/// A stored gap as the news that it was.
device::EventGap news_of(const store::Gap& row);

/// The last event of a tool, to go on behind it now.
device::LastEvent last_event_of(const store::Last& last, WallTime now);

/// The same gap as a row; tool and epoch are still to be named.
store::Gap row_of(const device::EventGap& gap, WallTime began, WallTime ended);

/// How a tool is named in a store: by its maker and serial number, or by the name of its target.
store::ToolName name_of(const device::Device& device, const std::string& target);

/// Follows in which epoch a tool counts its events, by what their source tells.
class EpochFollower {
 public:
  void note(const device::EventGap& gap);

  /// Whether the next event begins another epoch, and why. Asked once for each event.
  std::optional<store::EpochReason> begins() { return std::exchange(pending_, std::nullopt); }

 private:
  std::optional<store::EpochReason> pending_ = std::nullopt;
};

}  // namespace spindle::work
