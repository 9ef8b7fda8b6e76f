#include "spindle/work/event_rows.hpp"

#include <algorithm>

#include "spindle/catalogue/value.hpp"

namespace spindle::work {
namespace {

using catalogue::EventKind;

constexpr auto origin_words =
    enum_table<device::EventOrigin>({{"push", device::EventOrigin::push},
                                     {"poll", device::EventOrigin::poll},
                                     {"catch-up", device::EventOrigin::catch_up}});

/// No product has more presets that anyone asked for.
constexpr std::int64_t last_preset = 255;

/// A number in steps of the column; empty where it lies between two of them. That of a
/// floating-point number is the nearest step: it has more digits than were measured, and the block
/// keeps them.
std::optional<std::int64_t> in_steps(const catalogue::Value& value, std::int64_t steps,
                                     const catalogue::Encoding& encoding) {
  if (!value.is_number()) return std::nullopt;
  const auto scaled = value.number.times(Decimal(steps));
  if (!scaled) return std::nullopt;
  return (encoding.is_float() ? scaled->with_decimals(0) : *scaled).divided_by(Decimal(1));
}

/// "seating_torque" of an event is "seating" of a store.
std::optional<store::Column> column_of(std::string_view key) {
  constexpr std::string_view torque = "_torque";
  if (const auto column = store::column_words.find(key)) return column;
  if (!key.ends_with(torque)) return std::nullopt;
  return store::column_words.find(key.substr(0, key.size() - torque.size()));
}

/// "target-torque" of the catalogue is "target_torque" of a store.
std::optional<store::Setting> setting_of(catalogue::SettingKind kind) {
  std::string word(to_text(kind));
  std::replace(word.begin(), word.end(), '-', '_');
  return store::setting_words.find(word);
}

const catalogue::Parameter* parameter_named(const catalogue::Profile& profile,
                                            const std::string& name) {
  const auto found = std::find_if(profile.parameters.begin(), profile.parameters.end(),
                                  [&](const auto& each) { return each.name == name; });
  return found == profile.parameters.end() ? nullptr : &*found;
}

}  // namespace

bool is_torque(store::Column column) {
  using enum store::Column;
  return column == torque || column == target_torque || column == seating || column == clamp ||
         column == prevailing;
}

EventRows::EventRows(const catalogue::Profile& profile) : profile_(&profile), layout_(profile) {
  if (profile.events->settings.empty()) return;
  const catalogue::EventSetting& first = *profile.events->settings.begin();
  for (std::int64_t preset = 1; preset <= last_preset; ++preset) {
    if (parameter_named(profile, catalogue::name_of(first, preset)) == nullptr) break;
    presets_.push_back(preset);
  }
}

store::Event EventRows::row(const device::ToolEvent& news) const {
  store::Event row{.number = news.number.value_or(0),
                   .at = news.time,
                   .source = std::string(origin_words.text(news.source)),
                   .kind = std::string(
                       catalogue::to_text(layout_.kind_of(news.block).value_or(EventKind::other))),
                   .remembered = news.standing != device::Standing::result,
                   .raw = news.block};
  for (const auto& field : layout_.fields()) {
    if (!catalogue::EventLayout::has(field, news.block)) continue;
    const auto& [parameter, at, key, form] = field;
    const auto words = catalogue::register_count(parameter->encoding);
    const auto value = catalogue::decode(*parameter, RegisterView(news.block).subspan(at, words));
    if (!value) continue;
    if (const auto column = column_of(key)) {
      row.columns[*column] =
          in_steps(*value, is_torque(*column) ? store::torque_scale : 1, parameter->encoding);
    }
    if (key == "barcode" && value->content == catalogue::Content::text) row.barcode = value->text;
  }
  return row;
}

std::optional<std::int64_t> EventRows::preset_of(RegisterView block) const {
  if (!layout_.preset_at()) return std::nullopt;
  return block[*layout_.preset_at()];
}

bool EventRows::is_preset_change(RegisterView block) const {
  return layout_.kind_of(block) == EventKind::preset_change;
}

std::vector<catalogue::Parameter> EventRows::settings_of(std::int64_t preset) const {
  std::vector<catalogue::Parameter> wanted;
  for (const catalogue::EventSetting& setting : profile_->events->settings) {
    const auto* parameter = parameter_named(*profile_, catalogue::name_of(setting, preset));
    if (parameter != nullptr) wanted.push_back(*parameter);
  }
  return wanted;
}

std::optional<store::PresetSettings> EventRows::settings_row(
    std::int64_t preset, const std::vector<device::Reading>& readings) const {
  store::PresetSettings row{.preset = preset};
  bool any = false;
  for (const catalogue::EventSetting& setting : profile_->events->settings) {
    const auto column = setting_of(setting.is);
    const std::string name = catalogue::name_of(setting, preset);
    for (const device::Reading& reading : readings) {
      if (!column || reading.parameter.name != name || !reading.value) continue;
      const bool is_fine = *column == store::Setting::target_torque ||
                           setting.is == catalogue::SettingKind::torque_limit;
      row[*column] =
          in_steps(*reading.value, is_fine ? store::torque_scale : 1, reading.parameter.encoding);
      any = true;
    }
  }
  return any ? std::optional(row) : std::nullopt;
}

device::ToolEvent news_of(const store::EventView& row) {
  Registers block;
  block.reserve(row.raw.size() / 2);
  for (std::size_t at = 0; at + 1 < row.raw.size(); at += 2) block.push_back(get_u16(row.raw, at));
  return {.source = origin_words.find(row.source).value_or(device::EventOrigin::catch_up),
          .block = std::move(block),
          .time = row.at,
          .standing = row.remembered ? device::Standing::first : device::Standing::result,
          .number = row.number};
}

device::EventGap news_of(const store::Gap& row) {
  return {.missed = row.missed, .reason = row.reason, .after = row.after, .before = row.before};
}

device::LastEvent last_event_of(const store::Last& last, WallTime now) {
  // Where the clock was set back, nothing is known of how long the tool was not listened to.
  constexpr Duration long_unseen = std::chrono::hours(24);
  const Duration unseen = now < last.seen ? long_unseen : Duration(now - last.seen);
  return {.number = last.number, .block = last.block, .unseen = unseen};
}

store::Gap row_of(const device::EventGap& gap, WallTime began, WallTime ended) {
  return {.after = gap.after,
          .before = gap.before,
          .missed = gap.missed,
          .at_least = gap.sequence == device::Sequence::doubtful,
          .began = began,
          .ended = ended,
          .reason = gap.reason};
}

store::ToolName name_of(const device::Device& device, const std::string& target) {
  const auto& identity = device.identity();
  const bool is_blank = !identity || identity->serial.find_first_not_of("0 ") == std::string::npos;
  return {.maker = device.profile().maker.to_string(),
          .serial = is_blank ? "@" + target : identity->serial};
}

void EpochFollower::note(const device::EventGap& gap) {
  // Either it was restarted, or its counter began again behind 65535: never the same epoch.
  const bool fell = gap.after && gap.before && *gap.before <= *gap.after;
  if (gap.sequence == device::Sequence::doubtful && fell) pending_ = store::EpochReason::unsure;
  if (gap.sequence == device::Sequence::wrap) pending_ = store::EpochReason::wrap;
  if (gap.sequence == device::Sequence::restart) pending_ = store::EpochReason::restart;
}

}  // namespace spindle::work
